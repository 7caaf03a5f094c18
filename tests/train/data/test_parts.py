"""Parts of a recording."""

from dataclasses import replace

import numpy as np
import pytest

from train.data.parts import part


@pytest.mark.parametrize("frames", [slice(None, None, 2), slice(3, 7)])
def test_every_array_of_frames_is_taken_and_other_fields_stay(make_touch, frames):
    touch = make_touch()
    valid = np.ones(touch.frames.shape, bool)
    shorter = part(replace(touch, valid=valid), frames, meta={"labels": {}})
    assert shorter.t.tolist() == touch.t[frames].tolist()
    assert (shorter.frames == touch.frames[frames]).all()
    assert (shorter.joints == touch.joints[frames]).all()
    assert shorter.valid.shape == shorter.frames.shape
    assert shorter.shear is None
    assert shorter.meta == {"labels": {}}


def test_taxels_that_can_never_be_read_stay(make_touch, forearm):
    valid = np.ones(forearm.shape, bool)
    assert part(replace(make_touch(), valid=valid), slice(3)).valid is valid
