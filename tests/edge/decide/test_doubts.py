"""Reasons to doubt the frames of a window, at both sides of their limits."""

import numpy as np
import pytest

from edge.decide.doubts import frame_doubts
from edge.touch.layout import SkinLayout
from tests.edge.touch.pressed import followed, pressed

LAYOUT = SkinLayout(8, 8, threshold_counts=40, onset_counts=60, wraps=False)
WINDOW_S = 1.2


def series(times, taxels):
    """The series of a contact whose frame i has the pressed taxels(i)."""
    frames = [pressed(LAYOUT, t, taxels(i)) for i, t in enumerate(times)]
    return followed(LAYOUT, frames, horizon_s=2.0).series()


def growing(i):
    return {(3, 3): 100 + i}


def doubts(felt):
    return {flag for flag, holds in frame_doubts(felt, WINDOW_S).items() if holds}


TIMES = np.arange(140) * 0.01


def test_an_ordinary_contact_raises_no_doubt():
    assert doubts(series(TIMES, growing)) == set()


@pytest.mark.parametrize(("pause_s", "flags"), [(0.03, set()), (0.05, {"gap"})])
def test_a_pause_of_a_twentieth_of_a_second_is_a_gap(pause_s, flags):
    times = np.where(TIMES > 0.5, TIMES + pause_s, TIMES)
    assert doubts(series(times, growing)) == flags


@pytest.mark.parametrize(("pause_s", "flags"), [(0.2, set()), (0.5, {"gap"})])
def test_of_slow_frames_a_pause_is_compared_with_the_usual_one(pause_s, flags):
    times = np.arange(14) * 0.15
    late = np.where(times > 0.5, times + pause_s - 0.15, times)
    assert doubts(series(late, growing)) == flags


@pytest.mark.parametrize(("frames", "flags"), [(9, set()), (12, {"frozen"})])
def test_frames_that_repeat_for_a_tenth_of_a_second_are_frozen(frames, flags):
    def frozen(i):
        return growing(min(i, 50) if i <= 50 + frames else i)

    assert doubts(series(TIMES, frozen)) == flags
