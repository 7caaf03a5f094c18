"""`python -m export.prices`: times of a decision by the size of its model."""

from __future__ import annotations

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
from numpy.typing import NDArray
from skl2onnx import to_onnx as convert
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from edge.cli import dispatch
from edge.commands.bench import machine
from edge.commands.options import within
from edge.errors import InputError
from edge.files import write_whole
from edge.model.model import Model
from edge.touch.features import SAMPLES
from export.api import describe
from export.graph import to_onnx
from train.dataset import DataSet, load_trials
from train.pipeline import Choice, ContactClassifier
from train.progress import bar

COMPONENTS = (1, 2, 5, 10, 20)
NEIGHBOURS = (1, 2, 5, 20)
ROWS = (1_000, 10_000)
SIZE = (5, 2)
"""Components and k where another number is varied."""
SCALING = "IV"
CALLS = 300
ROUNDS = 15
FEWEST = 10
"""Trials below which there are no five components to measure."""


def grown(X: NDArray[np.float64], rows: int) -> NDArray[np.float64]:
    """`rows` vectors like those of X, repeated with a jitter of a thousandth; no call differs."""
    stream = np.random.default_rng(np.random.SeedSequence(0, spawn_key=(0x70726963,)))
    every = X[np.arange(rows) % len(X)]
    return every * (1.0 + 1e-3 * stream.normal(size=every.shape) * (rows > len(X)))


def medians_us(decisions: Sequence[Callable[[], object]], calls: int) -> list[float]:
    """Median microseconds of a call of each, taken in turns: a machine's pace drifts."""
    rounds = min(ROUNDS, calls)
    taken: list[list[int]] = [[] for _ in decisions]
    for _ in bar(range(rounds), desc="arithmetic", unit=" rounds"):
        for decide, times in zip(decisions, taken, strict=True):
            decide()
            for _ in range(max(calls // rounds, 1)):
                began = time.perf_counter_ns()
                decide()
                times.append(time.perf_counter_ns() - began)
    return [round(statistics.median(times) / 1e3, 1) for times in taken]


def sized(
    dataset: DataSet, X: NDArray[np.float64], task: str, components: int, k: int
) -> tuple[dict[str, Any], Callable[[], object]]:
    """A model of one task with so many rows, components and neighbours, and its decision."""
    y = dataset.labels(task)[np.arange(len(X)) % len(dataset.trials)]
    choice = Choice(SCALING, components, k)
    fitted = ContactClassifier({task: choice}, dataset.names).fit(X, {task: y})
    info = describe(dataset, fitted, {}, 1.2, SAMPLES)
    data = to_onnx(fitted, replace(info, rows=len(X)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(data)
        model = Model(path)
    vector = X[0] * 1.001
    size = {"rows": len(X), "components": components, "k": k, "operators": "ours, float64"}
    return {**size, "kilobytes": round(len(data) / 1024, 1)}, lambda: model.decide(vector)


def usual(
    X: NDArray[np.float64], y: NDArray[np.str_]
) -> tuple[dict[str, Any], Callable[[], object]]:
    """The same by skl2onnx's own conversion of scikit-learn's pipeline."""
    components, k = SIZE
    pipe = make_pipeline(StandardScaler(), PCA(components), KNeighborsClassifier(k)).fit(X, y)
    data = convert(pipe, X[:1].astype(np.float32), options={"zipmap": False}).SerializeToString()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    session = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    given = {session.get_inputs()[0].name: X[:1].astype(np.float32)}
    size = {"rows": len(X), "components": components, "k": k, "operators": "skl2onnx's own"}
    return {**size, "kilobytes": round(len(data) / 1024, 1)}, lambda: session.run(None, given)


def prices(dataset: DataSet, task: str, calls: int = CALLS) -> list[dict[str, Any]]:
    """Decisions with one number varied at a time, around `SIZE` at the data set's own rows."""
    X = dataset.features()
    n = len(X)
    most = min(n - 1, X.shape[1])
    cases = [(n, c, SIZE[1]) for c in COMPONENTS if c <= most]
    cases += [(n, SIZE[0], k) for k in NEIGHBOURS if k < n and k != SIZE[1]]
    cases += [(rows, *SIZE) for rows in ROWS if rows > n]
    models = [sized(dataset, grown(X, rows), task, c, k) for rows, c, k in cases]
    models.append(usual(X, dataset.labels(task)))
    times = medians_us([decide for _, decide in models], calls)
    return [{**size, "us": us} for (size, _), us in zip(models, times, strict=True)]


def run(arguments: argparse.Namespace) -> int:
    """Measure the times and write them."""
    dataset = load_trials(arguments.data, horizon_s=1.2)
    if len(dataset.trials) < FEWEST:
        raise InputError(f"prices need at least {FEWEST} trials, not {len(dataset.trials)}")
    task = "category" if "category" in dataset.tasks else dataset.tasks[0]
    measured = {
        "machine": f"{machine()['kind']} ({machine()['name']})",
        "data_digest": dataset.digest,
        "task": task,
        "decisions": prices(dataset, task, arguments.calls),
    }
    with write_whole(arguments.out) as file:
        file.write(json.dumps(measured, indent=1).encode() + b"\n")
    print(os.fspath(arguments.out))
    return 0


def parser() -> argparse.ArgumentParser:
    """The command line."""
    top = argparse.ArgumentParser(
        prog="export.prices",
        description="Measures how long one decision takes on this machine, by components, "
        "neighbours, training rows and operators; `python -m train tradeoff --prices` shows it.",
    )
    top.add_argument("--data", nargs="+", required=True, metavar="REC")
    top.add_argument("--out", type=Path, default=Path("build/tradeoff/prices.json"))
    top.add_argument(
        "--calls", type=within(int, 1, 1_000_000), default=CALLS, help=f"timed calls each ({CALLS})"
    )
    top.set_defaults(run=run)
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 for success, 2 for bad usage or input."""
    return dispatch(parser(), argv)


if __name__ == "__main__":
    sys.exit(main())
