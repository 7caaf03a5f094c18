"""Reasons to doubt the frames of a window, at both sides of their limits."""

import numpy as np
import pytest

from edge.decide.doubts import frame_doubts, joint_doubts, still_times
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


def paused(pause_s, step_s=0.01):
    """A contact whose frames pause once."""
    times = np.arange(0.0, 1.4, step_s)
    return series(np.where(times > 0.5, times + pause_s, times), growing)


def frozen(count):
    """A contact of which so many frames repeat one."""
    return series(TIMES, lambda i: growing(min(i, 50) if i <= 50 + count else i))


@pytest.mark.parametrize(
    ("felt", "flags"),
    [
        (paused(0.0), set()),
        (paused(0.03), set()),
        (paused(0.05), {"gap"}),
        # Of slow frames a pause is compared with the usual one.
        (paused(0.05, 0.15), set()),
        (paused(0.35, 0.15), {"gap"}),
        (frozen(9), set()),
        (frozen(12), {"frozen"}),
    ],
)
def test_frames_that_pause_or_repeat_are_a_doubt(felt, flags):
    assert doubts(felt) == flags


LEAD = 30
"""Frames before the contact."""
RATE = np.array([0.3, 0.4])
"""Radians a second of two joints, 0.5 together."""
TRAINING = {"limits": (), "still_s": (0.0, 0.1), "speeds": (0.49, 0.6)}


def of_joints(joints, lead=LEAD):
    """The series of a contact that begins with frame `lead` of 100 Hz; joints(t) are the
    angles, or None."""
    frames = []
    for i in range(lead + 140):
        taxels = {(3, 3): 100 + i} if i >= lead else {}
        frames.append(pressed(LAYOUT, i / 100, taxels, joints=joints(i / 100)))
    options = {"features": ["joint_change"], "joints": 2, "horizon_s": 2.0}
    return followed(LAYOUT, frames, **options).series()


def doubts_of_joints(felt, **training):
    flags = joint_doubts(felt, 1.2, **(TRAINING | training))
    return {flag for flag, holds in flags.items() if holds}


def moving(t):
    return RATE * t


def stopped(joint, after_s):
    """Angles that move, but for a joint from some seconds after onset on."""

    def joints(t):
        angles = RATE * t
        angles[joint] = RATE[joint] * min(t, LEAD / 100 + after_s)
        return angles

    return joints


@pytest.mark.parametrize(
    ("joint", "after_s", "flags"),
    [
        (0, 1.1, {"still_joints"}),
        (0, 1.16, set()),
        (1, 1.0, {"still_joints"}),
        (1, 1.1, set()),
    ],
)
def test_a_joint_that_rests_longer_than_in_training_is_still(joint, after_s, flags):
    assert doubts_of_joints(of_joints(stopped(joint, after_s))) == flags


def test_the_longest_standstill_is_of_each_joint():
    t = np.arange(6) * 0.1
    angles = np.array([[0, 1], [0, 2], [1, 2], [2, 2], [2, 3], [2, np.nan]])
    assert still_times(t, angles) == pytest.approx([0.2, 0.2])


@pytest.mark.parametrize(
    ("factor", "flags"),
    [(0.97, {"speed"}), (0.99, set()), (1.19, set()), (1.21, {"speed"})],
)
def test_an_arm_that_comes_slower_or_far_faster_than_in_training_is_a_doubt(
    factor, flags
):
    felt = of_joints(lambda t: factor * RATE * t)
    assert felt.speed == pytest.approx(factor * 0.5)
    assert doubts_of_joints(felt) == flags


@pytest.mark.parametrize(
    ("limit", "flags"),
    [
        ((0.56, 1.0), {"joint_limits"}),
        ((-1.0, 0.56), set()),
        ((-1.0, 0.3), {"joint_limits"}),
    ],
)
def test_joint_angles_beyond_their_limits_are_named(limit, flags):
    assert doubts_of_joints(of_joints(moving), limits=(limit, None)) == flags
