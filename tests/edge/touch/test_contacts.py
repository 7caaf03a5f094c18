"""The first contact of a recording, as the tracker gives it frame by frame."""

from dataclasses import replace

import numpy as np

from edge.touch.contacts import first_contact
from edge.touch.track import Tracker


def test_the_first_of_two_contacts_is_given_whole(make_touch, forearm):
    one = make_touch(seconds=0.5, arm=False)
    gap = np.zeros((30, *forearm.shape), dtype=np.uint16)
    frames = np.concatenate([one.frames, gap, 2 * one.frames])
    twice = replace(one, t=np.arange(len(frames)) / 100.0, frames=frames)
    onset_s, series = first_contact(twice, Tracker(forearm))
    assert onset_s == 0.2
    assert series.ended
    assert series.peak.max() == one.frames.max()


def test_a_recording_without_a_contact_gives_none(make_touch, forearm):
    still = make_touch(seconds=0.0, arm=False)
    assert first_contact(still, Tracker(forearm)) is None
