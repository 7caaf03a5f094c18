"""Sentences on data that make a model worse, or make it look better than it is."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from sklearn.neighbors import NearestNeighbors

from edge.arrays import Floats
from edge.errors import counted
from edge.features import names as measures
from train.data import outliers
from train.data.dataset import DataSet
from train.data.labels import NO_CONTACT
from train.fitted import Fitted
from train.model.pipeline import squared_distances
from train.model.projection import FEWEST_UNITS

MISSING_SHARE = 0.02
"""Share of recordings without a contact above which the thresholds get a warning."""
LEAK = 0.5
"""Share of labels that the posture at onset tells, above which it gets a warning."""
MOST_JUDGED = 1000
"""Of more trials, every second, third and so on is judged."""
NAMED = 3
"""A sentence names so many files and counts the rest."""


def warnings(fitted: Fitted) -> list[str]:
    """Sentences on data that make a model worse, or make it look better than it is."""
    dataset = fitted.dataset
    lines = [*_untouched(dataset), *_left_out(dataset)]
    lines += _outliers(fitted)
    longest = max(
        float(trial.recording.t[-1]) - trial.onset_s for trial in dataset.each()
    )
    if fitted.window_s > longest + 1e-9:
        lines.append(
            f"warning: the window of {fitted.window_s:g} s is too long: every "
            f"recording ends within {longest:.2f} s of the onset"
        )
    for task in fitted.chosen:
        lines += _task_warnings(fitted, task)
    return lines


def _untouched(dataset: DataSet) -> Iterator[str]:
    """A sentence on the recordings without a contact whose labels name one."""
    paths = [
        path for path, labels in dataset.untouched if NO_CONTACT not in labels.values()
    ]
    if not paths:
        return
    line = f"no contact above {dataset.layout.onset} counts, so counted as wrong: "
    line += _files(paths)
    total = len(dataset.trials) + len(dataset.untouched)
    if len(paths) / total > MISSING_SHARE:
        line = f"warning: {line}; `edge-classify thresholds` proposes thresholds"
    yield line


def _left_out(dataset: DataSet) -> Iterator[str]:
    """Sentences on recordings, and on contacts of a recording, that are not used."""
    files = {trial.path for trial in dataset.trials}
    for lacking, paths in dataset.left_out.items():
        yield (
            f"warning: {len(paths)} of {len(files.union(paths))} recordings are skipped "
            f"for lack of {lacking}: {_files(paths)}"
        )
    if dataset.unused:
        yield (
            "warning: only the first of several contacts is used in "
            f'{_files(dataset.unused)}; with meta.contacts of "alike" each is a trial'
        )


def _outliers(fitted: Fitted) -> Iterator[str]:
    """Sentences on recordings far outside all others, by features of the model.

    Features of single taxels are left out: most trials do not touch a taxel, so that
    any touch of it lies far outside.
    """
    measured = fitted.measured
    by_joints = list(outliers.by_joints(measured))
    yield from by_joints[:NAMED]
    more = len(by_joints) - NAMED
    if more > 0:  # angles in degrees are beyond the limits in every recording
        yield f"warning: {counted(more, 'further recording')} with such joint angles"
    names = [
        name
        for name in fitted.dataset.names
        if "kernels" not in name and not measures.feature(name).quantity.wide
    ]
    if names:
        dataset = fitted.dataset.of(names)
        X = dataset.features(fitted.window_s, fitted.samples)
        yield from outliers.by_features(dataset, X, dataset.widths(fitted.samples))


def _task_warnings(fitted: Fitted, task: str) -> Iterator[str]:
    """The sentences that concern a single task."""
    fitted_task = fitted.classifier.tasks_[task]
    choice = fitted.chosen[task].choice
    components = fitted_task.components
    if any(measures.feature(n).quantity.name == "joint_angle" for n in choice.features):
        share = posture_accuracy(fitted.dataset, task)
        yield (
            f"{'warning: ' if share > LEAK else ''}{task}: the joint angles at onset alone "
            f"give {share:.1%} of the labels (1-NN, leave-one-out), so the model may "
            "recognise places instead of objects; leave posture out of --features to judge "
            "touch alone"
        )
    if choice.components > components and choice.projection == "pca":
        yield (
            f"warning: {task}: the trials span {components} components, "
            f"{choice.components - components} fewer than asked for"
        )
    rows = fitted_task.rows
    members = fitted_task.space.trials
    _, different = np.unique(fitted.X[members], axis=0, return_index=True)
    steps = coarseness(rows[different], fitted_task.unit)
    if rows.any() and steps < FEWEST_UNITS:
        farthest = members[(rows**2).sum(axis=1).argmax()]
        yield (
            f"warning: {task}: half of the trials lie within {steps:.0f} of the "
            "model's steps from another trial, because "
            f"{fitted.dataset.trials[farthest].path} lies far outside all others; "
            "leave it out if the recording is wrong"
        )


def coarseness(rows: Floats, unit: float) -> float:
    """The coarseness of a model's grid for its trials, judged by at most a thousand of
    them.

    Args:
        rows: (n, c) projected trials, of which no two have the same features.
        unit: of their coordinates.

    Returns:
        The median distance, in units, from a trial to the nearest other one. It is 0 if
        a trial so far outside leaves all others the same coordinates, and infinite for
        a single trial.
    """
    every = -(-len(rows) // MOST_JUDGED)
    squares = squared_distances(rows[::every], rows)
    judged = np.arange(len(squares))
    squares[judged, every * judged] = np.inf
    return float(np.sqrt(np.median(squares.min(axis=1)))) / unit


def posture_accuracy(dataset: DataSet, task: str) -> float:
    """Leave-one-out accuracy of a task with the joint angles at onset alone and one
    neighbour."""
    at_onset = []
    for trial in dataset.each():
        joints = trial.series.joints
        assert joints is not None
        finite = joints[np.isfinite(joints).all(axis=1)]
        at_onset.append(finite[0] if len(finite) else np.zeros(joints.shape[1]))
    labels = dataset.labels(task)
    angles = np.array(at_onset)[labels != ""]
    labels = labels[labels != ""]
    neighbours = NearestNeighbors(n_neighbors=1).fit(angles)
    nearest = neighbours.kneighbors(return_distance=False)[:, 0]
    return float((labels[nearest] == labels).mean())


def _files(paths: Sequence[Path]) -> str:
    """The first paths, and the number of the others."""
    text = ", ".join(map(str, paths[:NAMED]))
    rest = len(paths) - NAMED
    return f"{text} and {rest} more" if rest > 0 else text
