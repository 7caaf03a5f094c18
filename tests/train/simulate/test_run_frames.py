"""The loop over frames, with functions whose answers are known beforehand."""

import numpy as np
import pytest
from numba import njit

from train.simulate.compiled import addresses, matrix
from train.simulate.run_frames import FULL, run_frames
from train.simulate.trial import TRIAL, compiled

FRAMES, STEPS = 4, 3
NONE = np.zeros(0, dtype=np.int64)


@compiled
def hurry(t):
    t.steps = 2 * STEPS if t.frame == 1.0 else STEPS


@compiled
def tune(t):
    t.y[0] = t.h
    t.y[1] += 1.0


@compiled
def begin_frame(t):
    t.frame += 1.0


@compiled
def step(t):
    t.q[0] += 1.0
    t.q[1] += t.frame


@njit
def bears(t):
    return t.q[0] - t.z


@compiled
def end_frame(t):
    t.force = bears(t)
    t.deepest = 2.0 * t.q[0]
    image = matrix(t.image, t.rows, t.columns)
    for column in range(t.columns):
        image[0, column] = 0.25 * (column + 1.0) * t.force


class Run:
    """Two trials that begin at 0 and 10 steps and bear what is beyond 3 and 14 of them."""

    def __init__(self, kind=np.uint16, whole=True, scale=1.0, frames=FRAMES, pace=NONE):
        self.trials = np.zeros(2, dtype=TRIAL)
        t = self.trials.view(np.recarray)
        t.here = addresses(t)
        t.joints, t.rows, t.columns, t.steps, t.rate_hz = 2, 1, 3, STEPS, 100.0
        t.q[:, 0], t.q[:, 2], t.z = [0.0, 10.0], 99.0, [3.0, 14.0]
        image = np.zeros((2, 1, 3))
        t.image = addresses(image)
        once = (np.array([f.address]) for f in (tune, begin_frame, step, end_frame))
        stages = (pace, *once)
        self.joints, self.force = np.full((2, FRAMES, 2), -1.0), np.zeros((2, FRAMES))
        self.window = np.zeros((2, frames, 1, 3), dtype=kind)
        traced = np.array([addresses(t) + TRIAL.fields[n][1] for n in ("deepest", "frame")])
        self.traces = np.zeros((2, 2, FRAMES))
        run_frames(
            self.trials,
            stages,
            self.joints,
            self.force,
            self.window,
            scale,
            whole,
            traced,
            self.traces,
        )


def test_the_first_frame_is_the_setup_s_and_each_other_one_follows_its_steps():
    run = Run()
    assert run.joints[:, :, 0].tolist() == [[0, 3, 6, 9], [10, 13, 16, 19]]
    # Three steps in the first frame, three in the second with twice as much, and so on.
    assert run.joints[:, :, 1].tolist() == 2 * [[0, 3, 9, 18]]
    assert run.force.tolist() == [[0, 0, 3, 6], [0, -1, 2, 5]]


def test_a_trial_takes_the_steps_that_its_pace_says_and_is_tuned_where_their_number_changes():
    run = Run(pace=np.array([hurry.address]))
    assert run.joints[:, :, 0].tolist() == [[0, 3, 9, 12], [10, 13, 19, 22]]
    t = run.trials.view(np.recarray)
    assert t.h.tolist() == t.y[:, 0].tolist() == 2 * [0.01 / STEPS]
    assert t.y[:, 1].tolist() == [2.0, 2.0]  # as it began to hurry, and as it did no more
    assert Run().trials["y"].tolist() == 2 * [[0.0, 0.0]]


def test_what_is_traced_is_as_each_frame_left_it():
    deepest, frame = Run().traces
    assert deepest.tolist() == [[0, 6, 12, 18], [0, 26, 32, 38]]
    assert frame.tolist() == 2 * [[0, 1, 2, 3]]


@pytest.mark.parametrize(
    ("kind", "whole", "shown"),
    [(np.uint16, True, [[2, 3, 4], [2, 5, 8]]),
     (np.float32, False, [[1.5, 3.0, 4.5], [2.5, 5.0, 7.5]])],
)  # fmt: skip
def test_a_load_is_shown_in_whole_counts_or_as_it_is_and_nothing_where_none_is(kind, whole, shown):
    window = Run(kind, whole, scale=2.0).window
    assert window[0, 2, 0].tolist() == shown[0]
    assert window[1, 3, 0].tolist() == shown[1]
    assert not window[:, :2].any()


@pytest.mark.parametrize(("kind", "whole"), [(np.uint16, True), (np.float32, False)])
def test_no_reading_is_above_the_converters_range(kind, whole):
    window = Run(kind, whole, scale=30000.0).window
    assert window[0, 3, 0].tolist() == [45000.0, FULL, FULL]


def test_a_window_of_no_frames_changes_nothing_else():
    run, bare = Run(), Run(frames=0)
    for name in ("joints", "force", "traces"):
        np.testing.assert_array_equal(getattr(bare, name), getattr(run, name))
