"""golden.npz: see `edge.decide.verify` for the format."""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Floats
from edge.decide.model import Model
from edge.decide.verify import answers, first_series, integers_of
from edge.record.recording import Recording
from edge.record.saving import save_arrays
from edge.touch.contact import FeatureSeries
from train.data.dataset import DataSet
from train.data.folds import finest
from train.data.parts import part

TRIALS = 24
"""Trials whose frames a golden file holds."""
VECTORS = 256
"""Feature vectors beyond the trials' own."""


def trials_of(dataset: DataSet, count: int) -> list[int]:
    """Trials spread evenly over the labels of the finest task."""
    y = {task: dataset.labels(task) for task in dataset.tasks}
    order = np.argsort(y[finest(y)], kind="stable")
    places = np.linspace(0, len(order) - 1, min(count, len(order))).round().astype(int)
    return sorted({int(order[i]) for i in places})


def trimmed(recording: Recording, onset_s: float, model: Model) -> Recording:
    """A quarter second before onset to two frames past the window."""
    times = (onset_s - 0.25, onset_s + model.info.window_s)
    first, last = np.searchsorted(recording.t, times)
    valid = np.array(True) if recording.valid is None else recording.valid
    with_valid = replace(
        recording, valid=np.broadcast_to(valid, recording.frames.shape)
    )
    return part(with_valid, slice(first, last + 2))


def write(path: Path, model: Model, dataset: DataSet, X: Floats) -> None:
    """Run the exported model on trials and vectors, and store its outputs.

    Vectors are the trials' own, training vectors (distance exactly 0), others between
    and beyond them, and two that are not finite (label -1).
    """
    info = model.info
    recordings = []
    onsets_s = []
    series = []
    for i in trials_of(dataset, TRIALS):
        trial = dataset.trials[i]
        recording = trimmed(trial.recording, trial.onset_s, model)
        first = first_series(recording, model)
        if first is not None:
            recordings.append(recording)
            onsets_s.append(first[0])
            series.append(first[1])
    arrays = _frames(model, recordings)
    arrays["onset_s"] = np.array(onsets_s)
    arrays["series_start"] = _starts(touch.t for touch in series)
    arrays["series_t"] = np.concatenate([touch.t for touch in series])
    arrays["series_counts"] = np.concatenate([integers_of(touch) for touch in series])
    arrays["vectors"] = _vectors(model, series, X)
    if info.decision_points_s:
        # The trials, which were trained with, and points between them.
        early = np.array(
            [[info.vector(c, s) for c in series] for s in info.decision_points_s]
        )
        between = 0.5 * (early + np.roll(early, 1, axis=1))
        vectors = np.concatenate([early, between], axis=1)
        arrays["decision_point_vectors"] = vectors
    meta = {
        "skin": recordings[0].meta.get("skin", {}),
        "model": info.data_digest,
    }
    save_arrays(path, arrays | answers(model, arrays), meta, compress=True)


def _frames(model: Model, recordings: Sequence[Recording]) -> dict[str, NDArray[Any]]:
    """The frames of recordings, end to end, with the angles and the shear that the
    model needs."""
    keys = ["t", "frames", "valid"]
    if model.info.dof is not None:
        keys.append("joints")
    if model.info.layout.axes:
        keys.append("shear")
    arrays = {"start": _starts(recording.t for recording in recordings)}
    for key in keys:
        arrays[key] = np.concatenate([vars(recording)[key] for recording in recordings])
    return arrays


def _starts(arrays: Iterable[NDArray[Any]]) -> NDArray[Any]:
    """Where parts start and end that are laid end to end."""
    return np.cumsum([0, *map(len, arrays)])


def _vectors(model: Model, series: Sequence[FeatureSeries], X: Floats) -> Floats:
    """The vectors of `write`."""
    rng = np.random.default_rng(20120101)
    of_trials = np.stack([model.info.vector(touch) for touch in series])
    rows = X[rng.permutation(len(X))[: VECTORS // 2]]
    first, second = rng.integers(0, len(X), (VECTORS // 2, 2)).T
    weight = rng.uniform(-0.5, 1.5, (len(first), 1))
    mixed = X[first] + weight * (X[second] - X[first])
    wrong = np.repeat(of_trials[:1], 2, axis=0)
    wrong[0, min(5, X.shape[1] - 1)] = np.nan
    wrong[1, -1] = np.inf
    return np.concatenate([of_trials, rows, mixed, wrong])
