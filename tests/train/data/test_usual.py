"""What the training touches showed, by which the board doubts others."""

from types import SimpleNamespace

import numpy as np
import pytest

from edge.errors import InputError
from train.data.usual import FASTER, RESTS, SLOWER, usual_touches


def touch(speed, rest=0, joints=True, beside=0, repeats=0, onset=""):
    """A series of a second at 10 Hz, in which the second of two joints rests for so many
    frames, and a second region is there in so many."""
    n = 11
    series = SimpleNamespace(t=np.arange(n) / 10, speed=speed, joints=None)
    if joints:
        moving = np.arange(n, dtype=float)
        series.joints = np.stack([moving, np.maximum(moving - rest, 0.0)], axis=1)
    series.same = (np.arange(n) > 0) & (np.arange(n) <= repeats)
    series.area = np.ones(n, int)
    series.felt = lambda window_s: SimpleNamespace(beside=np.arange(n) < beside)
    meta = {"onset": {"source": onset}} if onset else {}
    recording = SimpleNamespace(meta=meta)
    return SimpleNamespace(series=series, recording=recording, path=f"{onset}.npz")


def usual(labels, trials):
    dataset = SimpleNamespace(trials=trials, labels=lambda task: np.array(labels[task]))
    return usual_touches(dataset, list(labels), 1.0)


def test_labels_of_the_task_with_most_labels_often_have_a_second_region():
    labels = {"kind": ["a"] * 6, "object": ["fern"] * 5 + [""]}
    trials = [touch(1.0, beside=9 * (i in (0, 5))) for i in range(6)]
    assert usual(labels, trials)["several_labels"] == ("fern",)
    labels["object"] = ["fern"] * 6
    trials[0] = touch(1.0)
    assert usual(labels, trials)["several_labels"] == ()


def test_the_standstill_and_the_speeds_are_those_of_nearly_all_trials():
    trials = [touch(speed, rest=4) for speed in np.linspace(1.0, 2.0, 101)]
    trials.append(touch(np.nan))
    limits = usual({"object": ["box"] * 102}, trials)
    assert limits["still_s"] == pytest.approx((0.0, 0.4))
    assert limits["speeds"] == pytest.approx((1.01 * SLOWER, 1.99 * FASTER + RESTS))


def test_without_joint_angles_nothing_is_said_of_them():
    trials = [touch(np.nan, joints=False)] * 3
    keys = usual({"object": ["box"] * 3}, trials).keys()
    assert keys == {"several_labels", "repeats", "onset"}


@pytest.mark.parametrize(("repeating", "repeats"), [(1, False), (2, True)])
def test_frames_that_repeat_in_a_fifth_of_the_trials_are_usual(repeating, repeats):
    trials = [touch(1.0, repeats=10 * (i < repeating)) for i in range(10)]
    assert usual({"object": ["box"] * 10}, trials)["repeats"] is repeats


def test_all_onsets_come_from_one_source():
    trials = [touch(1.0, onset="event")] * 3
    assert usual({"object": ["box"] * 3}, trials)["onset"] == "event"
    assert usual({"object": ["box"] * 3}, [touch(1.0)] * 3)["onset"] == ""
    with pytest.raises(InputError, match="event.npz and .npz"):
        usual({"object": ["box"] * 4}, [*trials, touch(1.0)])
