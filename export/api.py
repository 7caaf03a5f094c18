"""Files of a fitted model, and the time and size of each candidate."""

import os
import platform
import statistics
import tempfile
import timeit
from collections.abc import Callable
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from edge import __version__
from edge.decide.info import ModelInfo, Task
from edge.decide.model import Model
from edge.touch.track import DEBOUNCE
from edge.writing import write_whole
from export import golden
from export.graph import to_onnx
from train.data.dataset import DataSet
from train.data.groups import TRIAL
from train.data.labels import NO_CONTACT
from train.data.usual import usual_touches
from train.fitted import Fitted
from train.model.pipeline import ContactClassifier
from train.report.summary import names

CALLS = 60
"""Decisions of which each candidate's time is the median."""
MOST_NAMES = 50_000
"""Characters of the trials' names beyond which a model file leaves them out; the digest
of the data then says which trials they were."""


def save(
    path: str | os.PathLike[str],
    fitted: Fitted,
    name: str | None = None,
    write_more: Callable[[Model], object] = lambda model: None,
) -> int:
    """Write a model, and `golden.npz` with its outputs beside it; the model's size in
    bytes.

    Args:
        path: of the model, such as `build/model.onnx`.
        fitted: the result of `train.fit`.
        name: of the model; that of the recordings' folder where None.
        write_more: writes what else is made of the model, before it takes its place.

    Raises:
        InputError: the files cannot be written. A model that cannot be read, or that
            `write_more` refuses, leaves the former one in its place.
    """
    data = to_onnx(fitted.sequential or fitted.classifier, describe(fitted, name))
    target = Path(path)
    with write_whole(target) as file:
        file.write(data)
        file.flush()
        model = Model(file.name)
        model.path = str(target)
        write_more(model)
    golden.write(
        target.with_name("golden.npz"),
        Model(target),
        fitted.dataset,
        fitted.X,
    )
    return len(data)


def describe(fitted: Fitted, name: str | None = None) -> ModelInfo:
    """The metadata that makes the model file describe itself.

    Args:
        fitted: a task that has no entry in its `chosen` has the accuracy 0.
        name: of the model; that of the recordings' folder where None.
    """
    dataset = fitted.dataset
    folder, all_trials = names(dataset)
    trials = tuple(all_trials[trial] for trial in fitted.classifier.trials_)
    packages = ("numpy", "scikit-learn", "onnx")
    return ModelInfo(
        tasks={task: _task(fitted, task) for task in fitted.classifier.choices},
        layout=dataset.layout,
        debounce=DEBOUNCE,
        window_s=fitted.window_s,
        samples=fitted.samples,
        features=dataset.names,
        units=dataset.units,
        motion_frame="skin" if dataset.chain is None else "world",
        chain=dataset.chain,
        joints=dataset.joints,
        kernels=dataset.kernels,
        rows=len(trials),
        data_digest=dataset.digest,
        versions={
            "edge-classify": __version__,
            "python": platform.python_version(),
            **{package: version(package) for package in packages},
        },
        **usual_touches(dataset, fitted.window_s),
        name=folder if name is None else name,
        trials=trials if sum(map(len, trials)) <= MOST_NAMES else (),
        **_calibration(fitted),
    )


def _calibration(fitted: Fitted) -> dict[str, Any]:
    """What the metadata say of decision points, where the model has them."""
    sequential = fitted.sequential
    if sequential is None:
        return {}
    return {
        "decision_points_s": tuple(sequential.decision_points_s),
        "stopping": sequential.stopping_,
        "outlier_score": sequential.outlier_score_,
        "usual": usual_ranges(fitted.dataset, fitted.window_s, fitted.samples),
    }


def _task(fitted: Fitted, task: str) -> Task:
    """What the metadata say of a task, whose settings need not have been chosen."""
    classifier = fitted.classifier
    choice = classifier.choices[task]
    chosen = fitted.chosen.get(task)
    classes = classifier.tasks_[task].classes
    labels = {*classes, *fitted.dataset.untouched_labels(task)}
    return Task(
        labels=tuple(map(str, classes)),
        k=choice.k,
        components=classifier.tasks_[task].components,
        scaling=choice.scaling,
        accuracy=0.0 if chosen is None else chosen.accuracy.accuracy,
        projection=choice.projection,
        features=tuple(n for n in fitted.dataset.names if n in choice.features),
        left_out=TRIAL if chosen is None else chosen.held_out,
        no_contact=NO_CONTACT if NO_CONTACT in labels else None,
        factors=classifier.joint_tasks_.get(task, {}),
    )


def usual_ranges(
    dataset: DataSet,
    window_s: float,
    samples: int,
) -> dict[str, tuple[float, float]]:
    """{feature: the mean over the window that 1 % of the trials are below, and that 1 %
    are above}."""
    X = dataset.features(window_s, samples)
    ends = np.cumsum(dataset.widths(samples))[:-1]
    ranges = {}
    for name, part in zip(dataset.names, np.split(X, ends, axis=1), strict=True):
        low, high = np.quantile(part.mean(axis=1), (0.01, 0.99)).tolist()
        ranges[name] = low, high
    return ranges


def measure(fitted: Fitted) -> list[tuple[float, float]]:
    """For each candidate: microseconds of a decision on this machine, and kilobytes."""
    return [_measured(fitted, i) for i in range(len(fitted.candidates))]


def _measured(fitted: Fitted, candidate: int) -> tuple[float, float]:
    picks = {task: chosen.picks[candidate] for task, chosen in fitted.chosen.items()}
    choices = {task: choice for task, choice in picks.items() if choice is not None}
    if not choices:
        return 0.0, 0.0
    dataset, vectors = fitted.selection(choices.values())
    classifier = ContactClassifier.of(choices, vectors)
    of_candidate = replace(
        fitted,
        dataset=dataset,
        classifier=classifier,
        chosen={},
        sequential=None,
    )
    data = to_onnx(classifier, describe(of_candidate))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(data)
        model = Model(path)
    series = fitted.measured.trials[0].series
    times = timeit.repeat(
        lambda: model.decide(model.info.vector(series)),
        number=1,
        repeat=CALLS,
    )
    return 1e6 * statistics.median(times), len(data) / 1024
