"""Files of a fitted model, and a report of the fit that a person reads."""

from __future__ import annotations

import os
import platform
import statistics
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from edge import __version__
from edge.files import write_whole
from edge.model.info import ModelInfo, Task
from edge.model.model import Model
from edge.touch import measures
from export import golden
from export.graph import to_onnx
from train.candidates import Candidate
from train.choose import TRIAL, Chosen
from train.dataset import DataSet
from train.evaluate import Result
from train.fitting import Fitted
from train.labels import NO_CONTACT
from train.pipeline import Choice, ContactClassifier, squared_distances
from train.projection import CLOSE_EIGENVALUES, FEWEST_UNITS
from train.report.score import interval
from train.stopping import SequentialClassifier

MISSING_SHARE = 0.02
"""Recordings without a contact above which the thresholds deserve a warning."""
LEAK = 0.5
"""Share of labels known before the touch, above which a model recognises the place, not the
object."""
NAMED = 3
"""Files that a sentence names; the rest are counted."""
CALLS = 60
MOST_NAMES = 50_000
"""Characters of the trials' names beyond which a model file leaves them out; the digest of the data
then says which trials they were."""


def save(path: str | os.PathLike[str], fitted: Fitted, name: str | None = None) -> int:
    """Write a model, and `golden.npz` with its outputs beside it; the model's size in bytes.

    Args:
        path: of the model, such as `build/model.onnx`.
        fitted: the result of `train.fit`.
        name: of the model; that of the recordings' folder where None.

    Raises:
        InputError: the files cannot be written.
    """
    parts = fitted.dataset, fitted.classifier, fitted.chosen, fitted.window_s, fitted.samples
    info = describe(*parts, fitted.sequential, name)
    data = to_onnx(fitted.sequential or fitted.classifier, info)
    target = Path(path)
    with write_whole(target) as file:
        file.write(data)
    golden.write(target.with_name("golden.npz"), Model(target), fitted.dataset, fitted.X)
    return len(data)


def describe(
    dataset: DataSet,
    classifier: ContactClassifier,
    chosen: Mapping[str, Chosen],
    window_s: float,
    samples: int,
    sequential: SequentialClassifier | None = None,
    name: str | None = None,
) -> ModelInfo:
    """The metadata that makes the model file describe itself.

    Args:
        dataset: measured for the features of the model.
        classifier: fitted on it.
        chosen: of each task, for its accuracy; 0 for a task that has no entry.
        window_s: of the full decision.
        samples: values of a feature.
        sequential: of which `classifier` is the last.
        name: of the model; that of the recordings' folder where None.
    """
    folder, trials = names(dataset)

    def no_contact(task: str) -> str | None:
        labels = {*classifier.classes_[task], *dataset.untouched_labels(task)}
        return NO_CONTACT if NO_CONTACT in labels else None

    return ModelInfo(
        tasks={
            task: Task(
                labels=tuple(map(str, classifier.classes_[task])),
                k=choice.k,
                components=classifier.components_[task],
                scaling=choice.scaling,
                accuracy=chosen[task].accuracy.accuracy if task in chosen else 0.0,
                projection=choice.projection,
                features=choice.features,
                left_out=chosen[task].left_out if task in chosen else TRIAL,
                no_contact=no_contact(task),
                factors=classifier.products_.get(task, {}),
            )
            for task, choice in classifier.choices.items()
        },
        layout=dataset.layout,
        tracking=dataset.tracking,
        window_s=window_s,
        samples=samples,
        features=dataset.names,
        units=dataset.units,
        motion_frame="skin" if dataset.chain is None else "world",
        chain=dataset.chain,
        joints=dataset.joints,
        kernels=dataset.kernels,
        rows=len(dataset.trials),
        data_digest=dataset.digest,
        versions={
            "edge-classify": __version__,
            "python": platform.python_version(),
            **{name: version(name) for name in ("numpy", "scikit-learn", "skl2onnx", "onnx")},
        },
        decision_points_s=() if sequential is None else tuple(sequential.decision_points_s),
        stopping={} if sequential is None else sequential.stopping_,
        novelty=None if sequential is None else sequential.novelty_,
        name=folder if name is None else name,
        trials=trials if sum(map(len, trials)) <= MOST_NAMES else (),
    )


def names(dataset: DataSet) -> tuple[str, tuple[str, ...]]:
    """The name of the folder of all recordings, and each trial's path in it without suffix.

    Trials of one recording are numbered from 1.
    """
    folder = Path(os.path.commonpath([trial.path.resolve().parent for trial in dataset.trials]))
    paths = [t.path.resolve().relative_to(folder).with_suffix("") for t in dataset.trials]
    counts, seen = Counter(paths), Counter[Path]()
    trials = []
    for path in paths:
        seen[path] += 1
        trials.append(path.as_posix() + (f" {seen[path]}" if counts[path] > 1 else ""))
    return folder.name, tuple(trials)


def report(fitted: Fitted, prices: Sequence[tuple[float, float]] | None = None) -> str:
    """The candidates, the choice of each task, notes and warnings, in lines."""
    lines = [*_table(fitted, prices), ""]
    for task, chosen in fitted.chosen.items():
        lines.append(f"{task}: {_accuracy(chosen)}")
        lines.append(f"  {_described(chosen.choice, fitted)}")
    dataset = fitted.dataset
    units: dict[str, list[str]] = {}
    for name, unit in dataset.units.items():
        units.setdefault("without unit" if unit == "1" else f"in {unit}", []).append(name)
    lines += ["", *(f"{unit}: {', '.join(names)}" for unit, names in units.items())]
    if any(measures.feature(name).moves for name in dataset.names):
        frame = "along the skin" if dataset.chain is None else "in the world"
        lines.append(f"contact motion is measured {frame}")
    return "\n".join([*lines, *fitted.notes, *warnings(fitted)])


def _accuracy(chosen: Chosen) -> str:
    """The accuracy of a task in words."""
    numbers = f"{_percent(chosen.accuracy)} of {chosen.accuracy.total} trials, nested"
    if chosen.left_out == TRIAL:
        return f"{numbers}, with the trial left out"
    return (
        f"{numbers}, with every trial of its {chosen.left_out} left out; "
        f"{chosen.by_trial.accuracy:.1%} with the trial alone left out"
    )


def _percent(result: Result) -> str:
    return f"{result.accuracy:.1%} ({interval(result)})"


def _described(choice: Choice, fitted: Fitted) -> str:
    how = f"{choice.projection} of {_name(choice, fitted.candidates)}, scaling {choice.scaling}"
    if choice.projection == "lda":
        how += f", shrinkage {choice.shrinkage:g}"
        if choice.targets:
            how += f", with the discriminants of {', '.join(choice.targets)} side by side"
    plural = "s" * (choice.components != 1)
    return f"{how}, {choice.components} component{plural}, k = {choice.k}"


def _name(choice: Choice, candidates: Sequence[Candidate]) -> str:
    known = {grid.features: c.name for c in reversed(candidates) for grid in c.grids}
    return known.get(choice.features, " ".join(choice.features))


def _table(fitted: Fitted, prices: Sequence[tuple[float, float]] | None) -> list[str]:
    """A row for each candidate: the nested accuracy of its own numbers, and its price."""
    wide = max(len(candidate.name) for candidate in fitted.candidates)
    lines = [f"{'features':<{wide}}  how" + "".join(f"  {task:>22}" for task in fitted.chosen)]
    lines[0] += "" if prices is None else "  us a decision      kB"
    for i, candidate in enumerate(fitted.candidates):
        line = f"{candidate.name:<{wide}}  {candidate.projection}"
        own = {(grid.features, grid.projection) for grid in candidate.grids}
        for chosen in fitted.chosen.values():
            star = "*" if (chosen.choice.features, chosen.choice.projection) in own else " "
            line += f"  {_percent(chosen.candidates[i]):>21}{star}"
        if prices is not None:
            line += f"  {prices[i][0]:>13.0f}  {prices[i][1]:>6.0f}"
        lines.append(line)
    return [*lines, "* chosen for the task"]


def warnings(fitted: Fitted) -> list[str]:
    """Sentences on data that flatter or spoil a model."""
    dataset, classifier, lines = fitted.dataset, fitted.classifier, []
    some = [path for path, labels in dataset.untouched if NO_CONTACT not in labels.values()]
    if some:
        line = f"without a contact above {dataset.layout.onset} counts, and counted as wrong: "
        line += _files(some)
        if len(some) / (len(dataset.trials) + len(dataset.untouched)) > MISSING_SHARE:
            line = f"warning: {line}; `python -m train thresholds` proposes thresholds"
        lines.append(line)
    for what, paths in dataset.left_out.items():
        total = len({trial.path for trial in dataset.trials} | set(paths))
        lines.append(
            f"warning: {len(paths)} of {total} recordings are left out for lack of {what}: "
            f"{_files(paths)}"
        )
    if dataset.unused:
        lines.append(
            "warning: only the first of several contacts is used of "
            f"{_files(dataset.unused)}; `python -m train split` makes a recording of each"
        )
    for task, chosen in fitted.chosen.items():
        names = chosen.choice.features
        if any(measures.feature(name).quantity == "joint_angle" for name in names):
            share = told_by_posture(dataset, task)
            lines.append(
                f"{'warning: ' if share > LEAK else ''}{task}: the joint angles at onset alone "
                f"give {share:.1%} of the labels (1-NN, leave-one-out), so the model may recognise "
                "places rather than objects; --features without posture measures touch alone"
            )
    longest = max(float(trial.recording.t[-1]) - trial.onset_s for trial in dataset.trials)
    if fitted.window_s > longest + 1e-9:
        lines.append(
            f"warning: the window of {fitted.window_s:g} s is longer than any recording goes on "
            f"after its onset ({longest:.2f} s)"
        )
    for task, chosen in fitted.chosen.items():
        space, components = classifier.spaces_[task], classifier.components_[task]
        dropped = chosen.choice.components - components
        if dropped > 0 and chosen.choice.projection == "pca":
            lines.append(
                f"warning: {task}: the trials span {components} components, {dropped} fewer than "
                "asked for"
            )
        rows = classifier.rows_[space][:, :components]
        equal = told_by_order(rows, classifier.labels_[task])
        if equal:
            lines.append(
                f"warning: {task}: {equal} trials have the same coordinates as a trial of another "
                "label; the earlier trial counts as nearer, so their order decides the label"
            )
        projection = classifier.projections_[space]
        steps, place = coarseness(rows, projection.grid_.unit)
        farthest = classifier.members_[space][place]
        if steps < FEWEST_UNITS:
            lines.append(
                f"warning: {task}: half of the trials lie within {steps:.0f} of the model's steps "
                f"of another one, since {dataset.trials[farthest].path} lies far outside all "
                "others; leave it out if its recording is wrong"
            )
        if projection.gap_ < CLOSE_EIGENVALUES:
            lines.append(
                f"warning: {task}: two components explain the same variance to within "
                f"{projection.gap_:.1e}; which of them is kept is arbitrary"
            )
    return lines


def told_by_order(rows: NDArray[np.float64], labels: NDArray[np.int64]) -> int:
    """How many rows (n, c) equal a row of another label (n,)."""
    _, group = np.unique(rows, axis=0, return_inverse=True)
    labels_of = np.zeros((len(rows), int(labels.max()) + 1), dtype=bool)
    labels_of[group.ravel(), labels] = True
    return int((labels_of.sum(axis=1) > 1)[group.ravel()].sum())


def coarseness(rows: NDArray[np.float64], unit: float) -> tuple[float, int]:
    """How coarse a model's grid is for its trials, by at most a thousand of them.

    Args:
        rows: (n, c) projected trials.
        unit: of their coordinates.

    Returns:
        The median distance, in units, from a trial to the nearest one that differs from it;
        infinite where all are equal. And the number of the trial that lies farthest out.
    """
    some = rows[:: -(-len(rows) // 1000)]
    squares = squared_distances(some, rows)
    squares[squares == 0.0] = np.inf
    nearest = float(np.sqrt(np.median(squares.min(axis=1)))) if rows.size else np.inf
    return nearest / unit, int(squared_distances(rows, np.zeros_like(rows[:1])).argmax())


def told_by_posture(dataset: DataSet, task: str) -> float:
    """Share of a task's trials whose nearest other one, by joint angles at onset, has the label."""
    at_onset = []
    for trial in dataset.trials:
        joints = trial.series.joints
        assert joints is not None
        known = joints[np.isfinite(joints).all(axis=1)]
        at_onset.append(known[0] if len(known) else np.zeros(joints.shape[1]))
    labels = dataset.labels(task)
    angles, labels = np.array(at_onset)[labels != ""], labels[labels != ""]
    squares = ((angles[:, None] - angles) ** 2).sum(axis=2)
    np.fill_diagonal(squares, np.inf)
    return float((labels[squares.argmin(axis=1)] == labels).mean())


def _files(paths: Sequence[Path]) -> str:
    rest = len(paths) - NAMED
    return ", ".join(map(str, paths[:NAMED])) + (f" and {rest} more" if rest > 0 else "")


def measure(fitted: Fitted) -> list[tuple[float, float]]:
    """For each candidate: microseconds of a decision on this machine, and kilobytes."""
    return [_measured(fitted, i) for i in range(len(fitted.candidates))]


def _measured(fitted: Fitted, candidate: int) -> tuple[float, float]:
    full = fitted.measured
    choices = {task: chosen.picks[candidate] for task, chosen in fitted.chosen.items()}
    names = tuple(n for n in full.names if any(n in c.features for c in choices.values()))
    tasks = {*choices, *(target for c in choices.values() for target in c.targets)}
    y = {task: full.labels(task) for task in tasks}
    part = full.of(names)
    X = part.features(fitted.window_s, fitted.samples)
    classifier = ContactClassifier(choices, names, part.widths(fitted.samples)).fit(X, y)
    data = to_onnx(classifier, describe(part, classifier, {}, fitted.window_s, fitted.samples))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(data)
        model = Model(path)
    series, taken = full.trials[0].series, []
    for _ in range(CALLS):
        began = time.perf_counter()
        model.decide(model.info.vector(series))
        taken.append(time.perf_counter() - began)
    return 1e6 * statistics.median(taken), len(data) / 1024
