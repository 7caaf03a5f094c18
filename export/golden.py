"""golden.npz: see `edge.model.verify` for the format."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.model.model import Model
from edge.model.verify import answers, first_series
from edge.recording import Recording
from edge.saving import save_arrays
from train.dataset import DataSet

TRIALS = 24
"""Trials whose frames a golden file holds."""
VECTORS = 256
"""Feature vectors beyond the trials' own."""
BOUNDS = {
    "features": 1e-12,
    "time_s": 1e-9,
}
"""Features are interpolated in a few operations, and motion passes through sines and
cosines that differ by an ulp between C libraries: below 100 ulp of metres. The bounds
leave a factor of 40 and more. All outputs of the graph must be equal, to the bit."""


def trials_of(dataset: DataSet, count: int) -> list[int]:
    """Trials spread evenly over the labels of the finest task."""
    finest = max(dataset.tasks, key=lambda task: len(set(dataset.labels(task))))
    order = np.argsort(dataset.labels(finest), kind="stable")
    chosen = np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int)
    return sorted({int(order[i]) for i in chosen})


def trimmed(recording: Recording, onset_s: float, model: Model) -> Recording:
    """A quarter second before onset to two frames past the window."""
    first, last = np.searchsorted(
        recording.t, (onset_s - 0.25, onset_s + model.info.window_s)
    )
    kept = slice(first, last + 2)
    valid = np.array(True) if recording.valid is None else recording.valid
    return replace(
        recording,
        t=recording.t[kept],
        frames=recording.frames[kept],
        joints=None if recording.joints is None else recording.joints[kept],
        shear=None if recording.shear is None else recording.shear[kept],
        valid=np.broadcast_to(valid, recording.frames.shape)[kept],
    )


def write(path: Path, model: Model, dataset: DataSet, X: NDArray[np.float64]) -> None:
    """Run the exported model on trials and vectors, and store its outputs.

    Vectors are the trials' own, training vectors (distance exactly 0), others between
    and beyond them, and two that are not finite (label -1).
    """
    info = model.info
    recordings: list[Recording] = []
    contacts: list[tuple[float, Any]] = []
    for i in trials_of(dataset, TRIALS):
        trial = dataset.trials[i]
        recording = trimmed(trial.recording, trial.onset_s, model)
        contact = first_series(recording, model)
        if contact is not None:
            recordings.append(recording)
            contacts.append(contact)
    rng = np.random.default_rng(20120101)
    own = np.stack([info.vector(s) for _, s in contacts])
    rows = X[rng.permutation(len(X))[: VECTORS // 2]]
    pairs = rng.integers(0, len(X), (VECTORS // 2, 2))
    weight = rng.uniform(-0.5, 1.5, (len(pairs), 1))
    mixed = X[pairs[:, 0]] + weight * (X[pairs[:, 1]] - X[pairs[:, 0]])
    wrong = np.repeat(own[:1], 2, axis=0)
    wrong[0, 5], wrong[1, -1] = np.nan, np.inf
    vectors = np.concatenate([own, rows, mixed, wrong])
    arrays: dict[str, NDArray[Any]] = {
        "start": np.cumsum([0, *(len(r.t) for r in recordings)]),
        "t": np.concatenate([r.t for r in recordings]),
        "frames": np.concatenate([r.frames for r in recordings]),
        "valid": np.concatenate([r.valid for r in recordings if r.valid is not None]),
        "onset_s": np.array([onset for onset, _ in contacts]),
        "series_start": np.cumsum([0, *(len(s.t) for _, s in contacts)]),
        "series_t": np.concatenate([s.t for _, s in contacts]),
        "series_counts": np.concatenate([s.integers for _, s in contacts]),
        "vectors": vectors,
    }
    if info.dof is not None:
        arrays["joints"] = np.concatenate(
            [r.joints for r in recordings if r.joints is not None]
        )
    if info.layout.axes:
        arrays["shear"] = np.concatenate(
            [r.shear for r in recordings if r.shear is not None]
        )
    if info.decision_points_s:
        windows = info.decision_points_s
        early = np.array(
            [[info.vector(s, window) for _, s in contacts] for window in windows]
        )
        # Besides the trials, which were trained with, points between them.
        between = 0.5 * (early + np.roll(early, 1, axis=1))
        arrays["decision_point_vectors"] = np.concatenate([early, between], axis=1)
    meta = {
        "skin": recordings[0].meta.get("skin", {}),
        "bounds": BOUNDS,
        "model": info.data_digest,
    }
    save_arrays(path, arrays | answers(model, arrays), meta, compress=True)
