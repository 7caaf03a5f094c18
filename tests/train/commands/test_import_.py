"""Offsets of a sensor that drifts are taken away at import."""

from dataclasses import replace

import numpy as np

from train.commands.import_ import zeroed


def test_a_constant_offset_is_subtracted_and_nothing_goes_below_zero(make_touch):
    trial = make_touch(arm=False)
    offset = np.random.default_rng(0).integers(0, 300, trial.frames.shape[1:]).astype(np.uint16)
    shifted = replace(trial, frames=trial.frames + offset)
    shifted.frames[-1] = 0
    back = zeroed(shifted)
    assert (back.frames[:-1] == trial.frames[:-1]).all()
    assert not back.frames[-1].any()
    assert back.frames.dtype == np.uint16
