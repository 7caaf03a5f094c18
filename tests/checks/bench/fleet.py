"""A synthetic set of features: many trials that vary about a few that were drawn.

`python -m tests.checks.bench.fleet RECORDINGS TRIALS OUT` fits them and writes the model.
A trial has the facts of one of the recordings, as objects of its own, and the arrays of its
contact. Its features vary about those of this recording by half of what they vary by
within an object, alike at all windows.
"""

import copy
import sys
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np

from export.api import save
from train.choose.options import FitOptions
from train.data.dataset import DataSet
from train.fitting import fit, load

SEED = 80
VARIES = 0.5
"""Deviation from the recording's features, as a share of that within the object."""


@dataclass(frozen=True)
class SyntheticSet(DataSet):
    """Trials of which each repeats one of the first few, whose number its file has."""

    recorded: int = 0

    def at_points(self, points_s, samples, names=None):
        numbers = np.array([int(trial.path.stem) for trial in self.trials])
        _, first, places = np.unique(
            numbers % self.recorded, return_index=True, return_inverse=True
        )
        trials = tuple(self.trials[i] for i in first)
        of_recordings = replace(self, trials=trials)
        centres = DataSet.at_points(of_recordings, points_s, samples, names)
        objects = of_recordings.labels("object")
        spread = np.sqrt(
            np.mean(
                [centres[:, objects == name].var(axis=1) for name in set(objects)],
                axis=0,
            )
        )
        measured = self.scratch.empty((len(points_s), len(numbers), centres.shape[2]))
        for i, (number, place) in enumerate(zip(numbers, places, strict=True)):
            noise = np.random.default_rng([SEED, number]).normal(size=spread.shape[1])
            measured[:, i] = centres[:, place] + VARIES * noise * spread
            if i % 64 == 0:
                self.scratch.release()
        return measured


def repeated(trial, number):
    """A trial with another number, whose arrays are in the same file."""

    def views(record):
        return {
            field.name: value[:] if isinstance(value, np.ndarray) else value
            for field in fields(record)
            for value in [getattr(record, field.name)]
        }

    recording = views(trial.recording) | {"meta": copy.deepcopy(trial.recording.meta)}
    series = views(trial.series)
    series["zones"] = {zone: rows[:] for zone, rows in series["zones"].items()}
    return replace(
        trial,
        path=Path(f"{number}.npz"),
        recording=replace(trial.recording, **recording),
        labels=dict(trial.labels),
        series=replace(trial.series, **series),
    )


def synthetic(dataset, count):
    """So many trials, from a data set of few."""
    recorded = len(dataset.trials)
    trials = tuple(repeated(dataset.trials[i % recorded], i) for i in range(count))
    return SyntheticSet(**{**vars(dataset), "trials": trials, "recorded": recorded})


if __name__ == "__main__":
    recordings, count, out = sys.argv[1:]
    options = FitOptions(jobs=1)
    dataset = synthetic(load(recordings, options).dataset, int(count))
    save(Path(out) / "model.onnx", fit(dataset, jobs=1, progress=True))
