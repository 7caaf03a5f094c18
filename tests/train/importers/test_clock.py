"""The one rule of time: order, jitter, repeated times, and angles across a gap."""

import numpy as np
import pytest

from edge.errors import InputError
from train.importers.clock import angles_at, order


def test_a_time_within_the_jitter_puts_its_frame_in_its_place():
    result = order(np.array([0.0, 0.1, 0.2, 0.16, 0.3]), "a.csv")
    assert result.frames.tolist() == [0, 1, 3, 2, 4]
    assert result.text == "1 time went back within the jitter"


@pytest.mark.parametrize(
    ("times", "sentence"),
    [
        ([0.0, 0.1, 0.2, 0.1, 0.3], r"a.csv: its time goes back by 0.1 s at row 4"),
        ([0.0, 0.1, 0.2, 0.149, 0.3], "goes back by 0.051 s at row 4"),
        ([0.0, 0.1, 0.2, 3600.3], "its time jumps by 3600.1 s at row 4"),
        ([0.0, 0.1, np.nan, 0.2, 0.3], "row 3 has no time"),
    ],
)
def test_other_times_are_refused(times, sentence):
    with pytest.raises(InputError, match=sentence):
        order(np.array(times), "a.csv", "row")


def test_a_log_that_is_written_on_change_alone_is_said_to_be_sparse():
    t = np.cumsum([0.01, 0.7, 0.02, 0.9, 1.3, 0.01, 0.2, 0.01, 0.4, 0.01])
    result = order(t, "a.bag")
    assert len(result.frames) == len(t)
    assert result.text.startswith("its steps are 0.01 to 1.3 s, as of a log that")


def test_of_few_frames_at_one_time_the_later_counts():
    t = 0.01 * np.arange(200)
    t[50] = t[49]
    result = order(t, "a.bag")
    assert 49 not in result.frames.tolist()
    assert len(result.frames) == 199
    assert result.text == "1 frame skipped, as later ones have their times"


def test_two_frames_in_a_hundred_at_one_time_stand_still():
    t = 0.01 * np.arange(100)
    t[[50, 70]] = t[[49, 69]]
    with pytest.raises(InputError, match="stands still at frame 51"):
        order(t, "a.bag")


def test_an_angle_that_wraps_goes_the_shorter_way():
    angles = np.array([[3.1], [-3.1]])
    (result,) = angles_at(np.array([0.05]), np.array([0.0, 0.1]), angles, 0.3)
    assert result[0] == pytest.approx(np.pi)


@pytest.mark.parametrize(
    ("gap_s", "step_s", "release_s", "is_known"),
    [
        (0.29, 0.01, 0.3, True),
        (0.31, 0.01, 0.3, False),  # more than release_s
        (0.99, 0.2, 0.3, True),
        (1.01, 0.2, 0.3, False),  # more than five steps
    ],
)
def test_across_a_gap_no_angle_is_known(gap_s, step_s, release_s, is_known):
    before = step_s * np.arange(6)
    joints_t = np.concatenate([before, before + before[-1] + gap_s])
    middle = np.array([before[-1] + 0.5 * gap_s])
    result = angles_at(middle, joints_t, joints_t[:, None], release_s)
    assert np.isfinite(result).all() == is_known


def test_angles_hold_for_a_moment_beyond_the_messages():
    joints_t = 0.01 * np.arange(11)
    angles = joints_t[:, None]
    t = np.array([-0.101, -0.099, 0.199, 0.201])
    result = angles_at(t, joints_t, angles, 0.3)[:, 0]
    assert np.isnan(result).tolist() == [True, False, False, True]
    assert result[1:3].tolist() == [0.0, 0.1]
