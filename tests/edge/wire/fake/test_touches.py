"""Touches of the demo on any skin: forces and lengths are kept."""

import numpy as np
import pytest

from edge import demo
from edge.record.recording import load
from edge.touch.track import ContactTracker, first_contact
from edge.wire.fake import touches
from edge.wire.skin import file as skinfile
from edge.wire.skin.file import parse
from tests.edge.wire.skin.small import one_chip


def wide(pitch=0.01, wraps="false"):
    """The file of a skin of 120 x 30 taxels."""
    scale = "counts_per_newton = 1000.0\nthreshold_counts = 1"
    return one_chip(120, 30, skin=f"pitch_m = {pitch}\nwraps = {wraps}\n{scale}")


def on_ring(pitch):
    """A touch of each contact on such a skin that is closed around."""
    return dict(touches.touches(parse(wide(pitch, "true")), trials=1))


@pytest.mark.parametrize("pitch", [0.004, 0.01, 0.02])
def test_the_force_of_a_contact_is_kept_whatever_the_pitch(pitch):
    """But for its strength, which a trial draws; on a ring nothing falls off beside."""
    sources = map(load, demo.recordings())
    for source, touch in zip(sources, on_ring(pitch).values(), strict=True):
        before, after = (r.frames.sum(axis=(1, 2)).max() for r in (source, touch))
        strength = after / before
        assert touches.STRENGTH[0] - 0.05 < strength < touches.STRENGTH[1] + 0.05


def test_every_contact_lasts_for_a_window_on_a_skin_whose_scale_is_unknown():
    file = skinfile.load(skinfile.shipped("mpr121"))
    repeated = dict(touches.touches(file, trials=3))
    for name, recording in touches.touches(file, trials=3):
        np.testing.assert_array_equal(recording.frames, repeated[name].frames)
        onset_s, _ = first_contact(recording, ContactTracker(recording.layout))
        assert recording.t[-1] > onset_s + 1.2, name
        assert file.layout.onset < recording.frames.max() <= 599, name
        assert set(recording.labels) >= {"category", "mobility", "object"}
        assert not recording.frames[recording.t < 0.2].any()
