"""What the training touches showed, by which the board doubts others."""

from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from edge.errors import InputError
from train.data.usual import FASTER, RESTS, SLOWER, usual_touches


def touch(speed, rest=0, joints=True, repeats=0, onset=""):
    """A series of a second at 10 Hz, in which the second of two joints rests for so many
    frames."""
    n = 11
    series = SimpleNamespace(t=np.arange(n) / 10, speed=speed, joints=None)
    if joints:
        moving = np.arange(n, dtype=float)
        series.joints = np.stack([moving, np.maximum(moving - rest, 0.0)], axis=1)
    series.same = (np.arange(n) > 0) & (np.arange(n) <= repeats)
    series.area = np.ones(n, int)
    meta = {"onset": {"source": onset}} if onset else {}
    recording = SimpleNamespace(meta=meta)
    return SimpleNamespace(series=series, recording=recording, path=f"{onset}.npz")


def usual(trials):
    dataset = SimpleNamespace(trials=trials, each=partial(iter, trials))
    return usual_touches(dataset, 1.0)


def test_the_standstill_and_the_speeds_are_those_of_nearly_all_trials():
    trials = [touch(speed, rest=4) for speed in np.linspace(1.0, 2.0, 101)]
    trials.append(touch(np.nan))
    limits = usual(trials)
    assert limits["still_s"] == pytest.approx((0.0, 0.4))
    assert limits["speeds"] == pytest.approx((1.01 * SLOWER, 1.99 * FASTER + RESTS))


def test_without_joint_angles_nothing_is_said_of_them():
    keys = usual([touch(np.nan, joints=False)] * 3).keys()
    assert keys == {"repeats", "onset"}


@pytest.mark.parametrize(("repeating", "repeats"), [(1, False), (2, True)])
def test_frames_that_repeat_in_a_fifth_of_the_trials_are_usual(repeating, repeats):
    trials = [touch(1.0, repeats=10 * (i < repeating)) for i in range(10)]
    assert usual(trials)["repeats"] is repeats


def test_all_onsets_come_from_one_source():
    trials = [touch(1.0, onset="event")] * 3
    assert usual(trials)["onset"] == "event"
    assert usual([touch(1.0)] * 3)["onset"] == ""
    with pytest.raises(InputError, match="event.npz and .npz"):
        usual([*trials, touch(1.0)])
