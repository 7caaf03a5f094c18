"""Runs the frames of trials, one trial after the other, through a plan's compiled functions."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from train.simulate.compiled import Array, call, floats, matrix

FULL = 65535.0
"""What the converter reads at most."""


@njit(error_model="numpy")
def show(t: Any, seen: NDArray[Any], scale: float, whole: bool) -> None:
    """The image (rows, columns) in counts, or in whole ones."""
    image = matrix(t.image, t.rows, t.columns)
    for row in range(t.rows):
        for column in range(t.columns):
            counts = image[row, column] * scale
            if whole:
                counts = np.rint(counts)
            seen[row, column] = min(counts, FULL)


@njit(error_model="numpy")
def set_pace(t: Any, pace: NDArray[np.int64], tune: NDArray[np.int64]) -> None:
    """Choose the steps of the trial's next frame."""
    before = t.steps
    for function in pace:
        call(function, t.here)
    if t.steps != before:
        t.h = 1.0 / (t.rate_hz * t.steps)
        for function in tune:
            call(function, t.here)


@njit(cache=True, error_model="numpy")
def set_paces(trials: NDArray[Any], pace: NDArray[np.int64], tune: NDArray[np.int64]) -> None:
    """The same of trials that run side by side."""
    for i in range(len(trials)):
        set_pace(trials[i], pace, tune)


@njit(cache=True, error_model="numpy")
def run_frames(
    trials: NDArray[Any],
    stages: tuple[NDArray[np.int64], ...],
    joints: Array,
    force: Array,
    window: NDArray[Any],
    scale: float,
    whole: bool,
    traced: NDArray[np.int64],
    traces: Array,
) -> None:
    """Run all frames of trials whose setup is done; the first frame is the setup's.

    Args:
        trials: (n,) records.
        stages: addresses of the functions of each stage of `plan.RUN_STAGES`.
        joints, force: (n, frames, dof) and (n, frames), to be filled.
        window: (n, frames, rows, columns) counts, to be filled where a load is borne; of no
            frames, where no images are asked for.
        scale: counts a newton.
        whole: whether the window has whole counts.
        traced: (quantities, n) addresses of what is kept of each frame, in `traces`
            (quantities, n, frames).
    """
    pace, tune, frame, step, sample = stages
    for i in range(len(trials)):
        t = trials[i]
        for j in range(t.joints):
            joints[i, 0, j] = t.q[j]
        for k in range(1, force.shape[1]):
            set_pace(t, pace, tune)
            for function in frame:
                call(function, t.here)
            for _ in range(t.steps):
                for function in step:
                    call(function, t.here)
            for function in sample:
                call(function, t.here)
            for j in range(t.joints):
                joints[i, k, j] = t.q[j]
            force[i, k] = t.force
            for m in range(len(traced)):
                traces[m, i, k] = floats(traced[m, i])[0]
            if window.shape[1] > 0 and t.force > 0.0:
                show(t, window[i, k], scale, whole)
