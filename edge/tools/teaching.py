"""Teaching a model on the board: trials become neighbours, in the projection that the
model has.

The neighbours of a task are constants of the model's graph that carry the task's name.
Only these constants change. Scaling, projection, calibration and certificates remain
those of the trials that the model was fitted on.
"""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError, about, printable
from edge.files import parsing
from edge.model import onnx_file
from edge.model.info import METADATA_KEY, ModelInfo
from edge.model.model import Model
from edge.model.onnx_file import Contents

NEAREST_OF_LABEL = 3
LABEL_SHARE = 20
JOINED = ("category", "softness", "mobility")
"""A task, and the two tasks whose labels its own are made of, joined by a hyphen."""


def nearest_of_label(sizes: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many trials stand for a label with so many trials: a twentieth, but at least
    three.

    A label with fewer than three trials is represented by all of them. With a share
    rather than a number, a label's distance does not shrink as its trials become more.
    """
    return np.minimum(sizes, np.maximum(-(-sizes // LABEL_SHARE), NEAREST_OF_LABEL))


def label_tables(labels: NDArray[np.int64], classes: int) -> dict[str, NDArray[Any]]:
    """The constants from which a graph takes the distances of labels.

    Args:
        labels: (n,) of the trials; -1 where one has none.
        classes: how many labels there are.

    Returns:
        `members` (classes, largest): the trials of each label, filled up with n.
            `counts`
        (classes,): how many trials stand for each label. `most` (1,): the largest
        count. `taken` (classes, most): True in the first `counts` columns of each
        label.
    """
    sizes = np.bincount(labels[labels >= 0], minlength=classes)
    counts = nearest_of_label(sizes)
    members = np.full((classes, int(sizes.max())), len(labels))
    for label, size in enumerate(sizes):
        members[label, :size] = np.flatnonzero(labels == label)
    return {
        "members": members,
        "most": counts.max(keepdims=True),
        "taken": np.arange(counts.max()) < counts[:, None],
        "counts": counts.astype(np.float64),
    }


def joined(labels: Mapping[str, str], tasks: Sequence[str] = JOINED) -> dict[str, str]:
    """{task: label} of a trial, with the labels of `tasks` that follow from its others.

    Args:
        labels: {task: label} of the trial.
        tasks: a task and its two factors, like `JOINED`.
    """
    product, *factors = tasks
    implied: dict[str, str] = {}
    if labels.get(product, "").count("-") == 1:
        implied = dict(zip(factors, labels[product].split("-"), strict=True))
    elif labels.keys() >= set(factors):
        implied = {product: "-".join(labels[factor] for factor in factors)}
    return {**implied, **labels}


def unknown_labels(
    info: ModelInfo, labels: Sequence[Mapping[str, str]]
) -> dict[str, Counter[str]]:
    """{task: {label that the model does not know: how many trials have it}}, the labels
    sorted.

    Args:
        info: of the model.
        labels: of each trial, {task: label}.
    """
    of_task = {
        task: [own[task] for own in labels if task in own] for task in info.tasks
    }
    return {
        task: Counter(
            sorted(label for label in each if label not in info.tasks[task].labels)
        )
        for task, each in of_task.items()
    }


def spelled_like(label: str, labels: Sequence[str]) -> str:
    """A question for the known label that an unknown one may have been meant as, if
    any."""
    from difflib import get_close_matches  # rarely needed, and slow to load

    return "".join(
        f"; did you mean {near!r}?" for near in get_close_matches(label, labels, 1, 0.8)
    )


def with_labels(info: ModelInfo, unknown: Mapping[str, Mapping[str, int]]) -> ModelInfo:
    """A model's metadata with new labels, each after those that its task knows.

    No more neighbours vote than a new label has trials, for it could win no vote among
    more.

    Args:
        info: of the model.
        unknown: {task: {new label: its number of trials}}.

    Raises:
        InputError: a task with a new label is decided together with others.
    """
    tasks = dict(info.tasks)
    for task, counts in unknown.items():
        for product, factors in info.products.items():
            if counts and task in (product, *factors):
                raise InputError(
                    f"{task} {next(iter(counts))!r} is new, but each {product} is a "
                    "pair of known "
                    f"labels of {' and '.join(factors)}; correct it, or export a model "
                    "with it"
                )
        entry = tasks[task]
        k = min([entry.k, *counts.values()])
        tasks[task] = replace(entry, labels=(*entry.labels, *counts), k=k)
    return replace(info, tasks=tasks)


def taught(
    model: Model,
    names: Sequence[str],
    vectors: NDArray[np.float64],
    labels: Sequence[Mapping[str, str]],
    *,
    new_labels: bool = False,
) -> bytes:
    """The model's file with further neighbours.

    A trial counts for the tasks for which it has a label that the model knows.

    Args:
        model: as it was exported, or taught before.
        names: (m,) of the trials' files.
        vectors: (decision points, m, width) of the trials.
        labels: (m,) {task: label}.
        new_labels: the model gets to know the labels that it does not know, see
            `with_labels`.

    Raises:
        InputError: a trial lies outside the projection's reach, or has no label that is
            known; or the file was exported by an earlier version.
    """
    info = model.info
    if new_labels:
        info = with_labels(info, unknown_labels(info, labels))
    for name, trial, trial_labels in zip(
        names, vectors.swapaxes(0, 1), labels, strict=True
    ):
        with about(name):
            points = [model.decide(vector, point) for point, vector in enumerate(trial)]
        if any(next(iter(decisions.values())).out_of_range for decisions in points):
            raise InputError(
                f"{name}: lies far outside the trials that the model was fitted on, so "
                "its "
                "projection cannot place it; export a model with it"
            )
        if not any(
            trial_labels.get(task) in entry.labels for task, entry in info.tasks.items()
        ):
            known = "; ".join(
                f"{t}: {', '.join(e.labels[:6])}" for t, e in info.tasks.items()
            )
            meant = [
                spelled_like(trial_labels.get(t, ""), e.labels)
                for t, e in info.tasks.items()
            ]
            raise InputError(
                f"{name}: has no label that the model knows ({known}); label it, or "
                "teach it with "
                f"--new-labels{''.join(meant)}"
            )
    contents = model.contents
    with parsing(model.path, "a model that can be taught", "; export it again"):
        changed: dict[str, NDArray[Any]] = {}
        for task, entry in info.tasks.items():
            index = {label: i for i, label in enumerate(entry.labels)}
            new = np.array([index.get(named.get(task, ""), -1) for named in labels])
            z = np.stack(
                [coordinates(contents, task, p, x) for p, x in enumerate(vectors)]
            )
            lengths = np.where(new < 0, np.inf, (z**2).sum(axis=2))
            more = {"columns": -2.0 * z.swapaxes(1, 2) * (new >= 0), "lengths": lengths}
            for key, values in more.items():
                old = contents.constant(f"{key} of {task}")
                values = values.reshape(*old.shape[:-1], len(names)).astype(old.dtype)
                changed[f"{key} of {task}"] = np.concatenate([old, values], axis=-1)
            all_labels = np.concatenate([contents.constant(f"labels of {task}"), new])
            changed[f"labels of {task}"] = all_labels
            tables, classes = {}, len(entry.labels)
            if classes > len(model.info.tasks[task].labels):
                tables = {
                    "ballots": np.eye(classes + 1, classes),
                    "k": np.array([entry.k]),
                }
            if f"members of {task}" in contents.tensors:
                tables |= label_tables(all_labels, classes)
            for key, table in tables.items():
                old = contents.constant(f"{key} of {task}")
                changed[f"{key} of {task}"] = table.astype(old.dtype)
    digest = hashlib.sha256(info.data_digest.encode() + vectors.tobytes()).hexdigest()
    trials = tuple(printable(Path(name).stem) for name in names)
    after = replace(
        info,
        rows=info.rows + len(names),
        trials=(*info.trials, *trials) if info.trials else (),
        taught=info.taught + len(names),
        data_digest=digest,
    )
    return onnx_file.rewritten(contents.data, changed, {METADATA_KEY: after.to_json()})


def coordinates(
    contents: Contents, task: str, point: int, x: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m, c) whole coordinates of vectors (m, width), by the graph's own operators."""
    *steps, _, _ = contents.path(
        f"{task}_neighbours"
    )  # the last two take the coordinates
    for operator, further in steps:
        values = [contents.constant(name, point) for name in further]
        if operator == "Gather":
            x = x[:, values[0]]
        elif operator in ("Sub", "Mul", "MatMul"):
            x = {"Sub": np.subtract, "Mul": np.multiply, "MatMul": np.matmul}[operator](
                x, *values
            )
        else:
            x = np.clip(x, *values) if operator == "Clip" else np.rint(x)
    return x
