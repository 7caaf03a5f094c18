"""What the training touches showed, by which the board doubts others."""

from types import SimpleNamespace

import numpy as np
import pytest

from train.data.usual import FASTER, RESTS, SLOWER, usual_touches


def touch(speed, rest=0, joints=True):
    """A series of a second at 10 Hz, in which the second of two joints rests for so many
    frames."""
    n = 11
    series = SimpleNamespace(t=np.arange(n) / 10, speed=speed, joints=None)
    if joints:
        moving = np.arange(n, dtype=float)
        series.joints = np.stack([moving, np.maximum(moving - rest, 0.0)], axis=1)
    return SimpleNamespace(series=series)


def usual(trials):
    return usual_touches(SimpleNamespace(trials=trials), 1.0)


def test_the_standstill_and_the_speeds_are_those_of_nearly_all_trials():
    trials = [touch(speed, rest=4) for speed in np.linspace(1.0, 2.0, 101)]
    trials.append(touch(np.nan))
    limits = usual(trials)
    assert limits["still_s"] == pytest.approx((0.0, 0.4))
    assert limits["speeds"] == pytest.approx((1.01 * SLOWER, 1.99 * FASTER + RESTS))


def test_without_joint_angles_nothing_is_said_of_them():
    assert usual([touch(np.nan, joints=False)] * 3) == {}
