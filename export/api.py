"""Files of a fitted model, and the time and size of each candidate."""

import os
import platform
import statistics
import tempfile
import time
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

import numpy as np

from edge import __version__
from edge.model.info import ModelInfo, Task
from edge.model.model import Model
from edge.touch.doubts import is_several
from edge.touch.track import DEBOUNCE
from edge.writing import write_whole
from export import golden
from export.graph import to_onnx
from train.choose import TRIAL, Chosen
from train.dataset import DataSet
from train.fitting import Fitted
from train.labels import NO_CONTACT
from train.pipeline import ContactClassifier
from train.report.summary import names
from train.stopping import SequentialClassifier

CALLS = 60
"""Decisions of which each candidate's time is the median."""
MOST_NAMES = 50_000
"""Characters of the trials' names beyond which a model file leaves them out; the digest
of the data then says which trials they were."""


def save(path: str | os.PathLike[str], fitted: Fitted, name: str | None = None) -> int:
    """Write a model, and `golden.npz` with its outputs beside it; the model's size in
    bytes.

    Args:
        path: of the model, such as `build/model.onnx`.
        fitted: the result of `train.fit`.
        name: of the model; that of the recordings' folder where None.

    Raises:
        InputError: the files cannot be written.
    """
    info = describe(
        fitted.dataset,
        fitted.classifier,
        fitted.chosen,
        fitted.window_s,
        fitted.samples,
        fitted.sequential,
        name,
    )
    data = to_onnx(fitted.sequential or fitted.classifier, info)
    target = Path(path)
    with write_whole(target) as file:
        file.write(data)
    golden.write(
        target.with_name("golden.npz"), Model(target), fitted.dataset, fitted.X
    )
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

    return ModelInfo(
        tasks={
            task: _task(dataset, classifier, task, chosen.get(task))
            for task in classifier.choices
        },
        layout=dataset.layout,
        debounce=DEBOUNCE,
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
            **{
                name: version(name)
                for name in ("numpy", "scikit-learn", "skl2onnx", "onnx")
            },
        },
        decision_points_s=()
        if sequential is None
        else tuple(sequential.decision_points_s),
        stopping={} if sequential is None else sequential.stopping_,
        novelty=None if sequential is None else sequential.novelty_,
        several=several_share(dataset, window_s),
        usual={} if sequential is None else usual_ranges(dataset, window_s, samples),
        name=folder if name is None else name,
        trials=trials if sum(map(len, trials)) <= MOST_NAMES else (),
    )


def _task(
    dataset: DataSet, classifier: ContactClassifier, task: str, chosen: Chosen | None
) -> Task:
    """What the metadata say of a task, whose settings need not have been chosen."""
    choice = classifier.choices[task]
    labels = {*classifier.classes_[task], *dataset.untouched_labels(task)}
    return Task(
        labels=tuple(map(str, classifier.classes_[task])),
        k=choice.k,
        components=classifier.components_[task],
        scaling=choice.scaling,
        accuracy=0.0 if chosen is None else chosen.accuracy.accuracy,
        projection=choice.projection,
        features=choice.features,
        left_out=TRIAL if chosen is None else chosen.left_out,
        no_contact=NO_CONTACT if NO_CONTACT in labels else None,
        factors=classifier.products_.get(task, {}),
    )


def usual_ranges(
    dataset: DataSet, window_s: float, samples: int
) -> dict[str, tuple[float, float]]:
    """{feature: the mean over the window that 1 % of the trials are below, and that 1 %
    are above}."""
    X = dataset.features(window_s, samples)
    ends = np.cumsum(dataset.widths(samples))[:-1]
    ranges = {}
    for name, part in zip(dataset.names, np.split(X, ends, axis=1), strict=True):
        low, high = np.quantile(part.mean(axis=1), (0.01, 0.99))
        ranges[name] = float(low), float(high)
    return ranges


def several_share(dataset: DataSet, window_s: float) -> float:
    """Share of the trials with a second region beside the contact."""
    windows = [trial.series.felt(window_s) for trial in dataset.trials]
    return sum(map(is_several, windows)) / len(windows)


def measure(fitted: Fitted) -> list[tuple[float, float]]:
    """For each candidate: microseconds of a decision on this machine, and kilobytes."""
    return [_measured(fitted, i) for i in range(len(fitted.candidates))]


def _measured(fitted: Fitted, candidate: int) -> tuple[float, float]:
    choices = {task: chosen.picks[candidate] for task, chosen in fitted.chosen.items()}
    dataset = fitted.measured.of(
        [name for c in choices.values() for name in c.features]
    )
    tasks = {
        *choices,
        *(target for choice in choices.values() for target in choice.targets),
    }
    y = {task: dataset.labels(task) for task in tasks}
    X = dataset.features(fitted.window_s, fitted.samples)
    widths = dataset.widths(fitted.samples)
    classifier = ContactClassifier(choices, dataset.names, widths).fit(X, y)
    data = to_onnx(
        classifier, describe(dataset, classifier, {}, fitted.window_s, fitted.samples)
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(data)
        model = Model(path)
    series = fitted.measured.trials[0].series
    seconds = []
    for _ in range(CALLS):
        began = time.perf_counter()
        model.decide(model.info.vector(series))
        seconds.append(time.perf_counter() - began)
    return 1e6 * statistics.median(seconds), len(data) / 1024
