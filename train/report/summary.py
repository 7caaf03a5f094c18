"""A fit summed up for a terminal: the candidates, the choices, and warnings."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.neighbors import NearestNeighbors

from edge.errors import printable
from edge.touch import measures
from train.choose import Chosen
from train.dataset import DataSet
from train.feature_sets import SETS, expand, moves
from train.fitting import Fitted
from train.groups import TRIAL
from train.labels import NO_CONTACT
from train.pipeline import Choice, squared_distances
from train.projection import CLOSE_EIGENVALUES, FEWEST_UNITS
from train.report.score import interval
from train.report.section import Row, Table, counted

MISSING_SHARE = 0.02
"""Share of recordings without a contact above which the thresholds get a warning."""
LEAK = 0.5
"""Share of labels that the posture at onset tells, above which it gets a warning."""
MOST_JUDGED = 1000
"""Of more trials, every second, third and so on is judged."""
NAMED = 3
"""A sentence names so many files and counts the rest."""
Prices = Sequence[tuple[float, float]]
"""Microseconds of a decision on this machine, and kilobytes, for each candidate."""


def summary(fitted: Fitted, prices: Prices) -> str:
    """The candidates, the choice for each task, notes and warnings, as lines of
    text."""
    table = candidates(fitted, prices)
    cells = [[str(cell) for cell in row] for row in (table.columns, *table.cells)]
    widths = [max(map(len, column)) for column in zip(*cells, strict=True)]
    lines = [
        "  ".join(
            f"{row[i]:{'<' if i < 2 else '>'}{width}}" for i, width in enumerate(widths)
        )
        for row in cells
    ]
    lines += [
        "* chosen; in brackets, the 95 % interval of the accuracy on other trials",
        "",
    ]
    for task, chosen in fitted.chosen.items():
        lines += [
            f"{task}: {accuracy(chosen)}",
            f"  {_described(chosen.choice, fitted)}",
        ]
        if fitted.early is not None:
            early = _described(fitted.early.choices[task], fitted)
            lines.append(f"  before {fitted.early.until_s:g} s: {early}")
    lines += ["", *_by_unit(fitted.dataset.units)]
    if any(moves(measures.feature(name)) for name in fitted.dataset.names):
        frame = "along the skin" if fitted.dataset.chain is None else "in the world"
        lines.append(f"contact motion is measured {frame}")
    return "\n".join([*lines, *fitted.notes, *warnings(fitted)])


def _by_unit(units: Mapping[str, str]) -> list[str]:
    """A line for each unit, with its features, from {feature: its unit}."""
    features: dict[str, list[str]] = {}
    for name, unit in units.items():
        words = "without unit" if unit == "1" else f"in {unit}"
        features.setdefault(words, []).append(name)
    return [f"{words}: {', '.join(names)}" for words, names in features.items()]


def candidates(fitted: Fitted, prices: Prices) -> Table:
    """A row for each candidate, with the nested accuracy of its own settings and its
    price."""
    rows: list[Row] = []
    for i, candidate in enumerate(fitted.candidates):
        pairs = {(grid.features, grid.projection) for grid in candidate.grids}
        row: Row = {"features": candidate.name, "projection": candidate.projection}
        for task, chosen in fitted.chosen.items():
            star = (
                "*"
                if (chosen.choice.features, chosen.choice.projection) in pairs
                else " "
            )
            result = chosen.candidates[i]
            row[task] = f"{result.accuracy:.1%} ({interval(result)}){star}"
        us, kilobytes = prices[i]
        rows.append({**row, "us per decision": round(us, 1), "kB": round(kilobytes, 1)})
    return Table("candidates", "Candidates", rows, ("us per decision",), narrow=3)


def accuracy(chosen: Chosen) -> str:
    """The nested accuracy of a task in words."""
    numbers = (
        f"{chosen.accuracy.accuracy:.1%} of {chosen.accuracy.total} trials are "
        f"classified correctly (95 % interval {interval(chosen.accuracy)}), each by a "
        "model chosen and fitted without "
    )
    if chosen.left_out == TRIAL:
        return f"{numbers}this trial"
    alone = f"{chosen.by_trial.accuracy:.1%} if only the trial itself is left out"
    return f"{numbers}any trial of the same {chosen.left_out}; {alone}"


def _described(choice: Choice, fitted: Fitted) -> str:
    """The settings of a choice as text."""
    combinations = {expand([name]): name for name in SETS}
    for candidate in reversed(fitted.candidates):
        combinations |= {grid.features: candidate.name for grid in candidate.grids}
    name = combinations.get(choice.features, " ".join(choice.features))
    how = f"{choice.projection} of {name}, scaling {choice.scaling}"
    if choice.projection == "lda":
        how += f", shrinkage {choice.shrinkage:g}"
        if choice.targets:
            how += f", with the discriminants of {' and '.join(choice.targets)} side by side"
    return f"{how}, {counted(choice.components, 'component')}, k = {choice.k}"


def warnings(fitted: Fitted) -> list[str]:
    """Sentences on data that make a model worse, or make it look better than it is."""
    dataset = fitted.dataset
    lines = []
    untouched = [
        path for path, labels in dataset.untouched if NO_CONTACT not in labels.values()
    ]
    if untouched:
        line = f"no contact above {dataset.layout.onset} counts, so counted as wrong: "
        line += _files(untouched)
        if (
            len(untouched) / (len(dataset.trials) + len(dataset.untouched))
            > MISSING_SHARE
        ):
            line = f"warning: {line}; `python -m train thresholds` proposes thresholds"
        lines.append(line)
    for lacking, paths in dataset.left_out.items():
        total = len({trial.path for trial in dataset.trials} | set(paths))
        lines.append(
            f"warning: {len(paths)} of {total} recordings are left out for lack of "
            f"{lacking}: {_files(paths)}"
        )
    if dataset.unused:
        lines.append(
            "warning: only the first of several contacts is used in "
            f"{_files(dataset.unused)}; "
            "`python -m train split` makes a recording of each contact"
        )
    longest = max(
        float(trial.recording.t[-1]) - trial.onset_s for trial in dataset.trials
    )
    if fitted.window_s > longest + 1e-9:
        lines.append(
            f"warning: the window of {fitted.window_s:g} s is too long: every "
            f"recording ends within {longest:.2f} s of the onset"
        )
    return [
        *lines,
        *(line for task in fitted.chosen for line in _task_warnings(fitted, task)),
    ]


def _task_warnings(fitted: Fitted, task: str) -> list[str]:
    """The sentences that concern a single task."""
    dataset = fitted.dataset
    classifier = fitted.classifier
    choice = fitted.chosen[task].choice
    space = classifier.spaces_[task]
    components = classifier.components_[task]
    lines = []
    if any(
        measures.feature(name).quantity == "joint_angle" for name in choice.features
    ):
        share = posture_accuracy(dataset, task)
        lines.append(
            f"{'warning: ' if share > LEAK else ''}{task}: the joint angles at onset "
            f"alone give {share:.1%} of the labels (1-NN, leave-one-out), so the "
            "model may recognise places instead of objects; leave posture out of "
            "--features to judge touch alone"
        )
    if choice.components > components and choice.projection == "pca":
        lines.append(
            f"warning: {task}: the trials span {components} components, "
            f"{choice.components - components} fewer than asked for"
        )
    rows = classifier.rows_[space][:, :components]
    equal = tied_across_labels(rows, classifier.labels_[task])
    if equal:
        lines.append(
            f"warning: {task}: {equal} trials have the same coordinates as a trial "
            "with another label; the earlier trial counts as nearer, so their order "
            "decides the label"
        )
    projection = classifier.projections_[space]
    members = classifier.members_[space]
    _, different = np.unique(fitted.X[members], axis=0, return_index=True)
    steps = coarseness(rows[different], projection.grid_.unit)
    if steps < FEWEST_UNITS:
        farthest = dataset.trials[members[(rows**2).sum(axis=1).argmax()]].path
        lines.append(
            f"warning: {task}: half of the trials lie within {steps:.0f} of the "
            f"model's steps from another trial, because {farthest} lies far outside "
            "all others; leave it out if the recording is wrong"
        )
    if projection.gap_ < CLOSE_EIGENVALUES:
        lines.append(
            f"warning: {task}: two components explain the same variance to within "
            f"{projection.gap_:.1e}; which of them is kept is arbitrary"
        )
    return lines


def tied_across_labels(rows: NDArray[np.float64], labels: NDArray[np.int64]) -> int:
    """The number of rows (n, c) that equal a row with another label (n,)."""
    _, group = np.unique(rows, axis=0, return_inverse=True)
    labels_of = np.zeros((len(rows), int(labels.max()) + 1), dtype=bool)
    labels_of[group.ravel(), labels] = True
    return int((labels_of.sum(axis=1) > 1)[group.ravel()].sum())


def coarseness(rows: NDArray[np.float64], unit: float) -> float:
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
    for trial in dataset.trials:
        joints = trial.series.joints
        assert joints is not None
        finite = joints[np.isfinite(joints).all(axis=1)]
        at_onset.append(finite[0] if len(finite) else np.zeros(joints.shape[1]))
    labels = dataset.labels(task)
    angles = np.array(at_onset)[labels != ""]
    labels = labels[labels != ""]
    nearest = (
        NearestNeighbors(n_neighbors=1)
        .fit(angles)
        .kneighbors(return_distance=False)[:, 0]
    )
    return float((labels[nearest] == labels).mean())


def names(dataset: DataSet) -> tuple[str, tuple[str, ...]]:
    """The name of the folder that holds all recordings, and each trial's path in it.

    The paths have no suffix. If a recording has several trials, they are numbered from
    1. Names that are no text have escapes.
    """
    folder = Path(
        os.path.commonpath([trial.path.resolve().parent for trial in dataset.trials])
    )
    paths = [
        t.path.resolve().relative_to(folder).with_suffix("") for t in dataset.trials
    ]
    counts = Counter(paths)
    trials_of = Counter[Path]()
    trials = []
    for path in paths:
        trials_of[path] += 1
        number = f" {trials_of[path]}" if counts[path] > 1 else ""
        trials.append(printable(path.as_posix()) + number)
    return printable(folder.name), tuple(trials)


def _files(paths: Sequence[Path]) -> str:
    """The first paths, and the number of the others."""
    rest = len(paths) - NAMED
    return ", ".join(map(str, paths[:NAMED])) + (
        f" and {rest} more" if rest > 0 else ""
    )
