"""Teaching a model on the board: trials become neighbours, in its own projection.

The neighbours of a task are constants of the model's graph that carry the task's name.
Only these constants change. Scaling, projection, calibration and certificates remain
those of the trials that the model was fitted on.
"""

import hashlib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.arrays import Array, Booleans, Floats, Integers
from edge.errors import InputError, about, printable
from edge.files import parsing
from edge.model.graph import Graph, coordinates_of
from edge.model.info import METADATA_KEY, ModelInfo, Task
from edge.model.metadata import to_json
from edge.model.model import Model
from edge.model.onnx_file import Node
from edge.tools.rewriting import rewritten

Labels = Mapping[str, str]
"""{task: label} of a trial."""
NOVELTY_COLUMNS = "columns of novelty"
NOVELTY_LENGTHS = "lengths of novelty"
"""Constants in which a graph that scores novelty holds the training trials."""
NEAREST_OF_LABEL = 3
LABEL_SHARE = 20
JOINED = ("category", "softness", "mobility")
"""A task, and the two tasks whose labels its own are made of, joined by a hyphen."""


def nearest_of_label(sizes: Integers) -> Integers:
    """Number of trials that stand for a label: a twentieth of its own, at least three.

    A label with fewer than three trials is represented by all of them. With a share
    rather than a number, a label's distance does not shrink as its trials become more.
    """
    return np.minimum(sizes, np.maximum(-(-sizes // LABEL_SHARE), NEAREST_OF_LABEL))


def label_tables(labels: Integers, classes: int) -> dict[str, Array]:
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


def joined(labels: Labels, tasks: Sequence[str] = JOINED) -> dict[str, str]:
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


def label_counts(task: str, labels: Sequence[Labels]) -> Counter[str]:
    """How many trials have each label of a task."""
    return Counter(trial[task] for trial in labels if task in trial)


def unknown_labels(
    info: ModelInfo, labels: Sequence[Labels]
) -> dict[str, dict[str, int]]:
    """{task: {label that the model does not know: its number of trials}}, sorted.

    Args:
        info: of the model.
        labels: of each trial, {task: label}.
    """
    unknown = {}
    for task, entry in info.tasks.items():
        counts = sorted(label_counts(task, labels).items())
        unknown[task] = {
            label: count for label, count in counts if label not in entry.labels
        }
    return unknown


def spelled_like(label: str, labels: Sequence[str]) -> str:
    """A question for the known label that an unknown one may have been meant as, if
    any."""
    from difflib import get_close_matches  # rarely needed, and slow to load

    near = get_close_matches(label, labels, 1, 0.8)
    return f"; did you mean {near[0]!r}?" if near else ""


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
                    f"pair of known labels of {' and '.join(factors)}; correct it, or "
                    "export a model with it"
                )
        entry = tasks[task]
        k = min([entry.k, *counts.values()])
        tasks[task] = replace(entry, labels=(*entry.labels, *counts), k=k)
    return replace(info, tasks=tasks)


def taught(
    model: Model,
    names: Sequence[str],
    vectors: Floats,
    labels: Sequence[Labels],
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
        InputError: a trial lies outside the projection's reach, or further out than
            exact distances allow; or has no label that is known; or the file was
            exported by an earlier version.
    """
    info = model.info
    if new_labels:
        info = with_labels(info, unknown_labels(info, labels))
    for name, trial, trial_labels in zip(
        names,
        vectors.swapaxes(0, 1),
        labels,
        strict=True,
    ):
        _check_reach(model, name, trial)
        _check_labels(info, name, trial_labels)
    changed: dict[str, Array] = {}
    with parsing(model.path, "a model that can be taught", "; export it again"):
        graph = Graph(model.contents)
        for task, entry in info.tasks.items():
            index = {label: i for i, label in enumerate(entry.labels)}
            indices = np.array([index.get(trial.get(task, ""), -1) for trial in labels])
            z = _values(graph, coordinates_of(graph, task), vectors)
            outside = (indices >= 0) & ~within_reach(graph, task, z)
            if outside.any():
                raise _far_outside(names[int(outside.argmax())])
            rows = _rows(graph, task, z, indices)
            changed |= rows
            changed |= _votes(model, graph, entry, task, rows)
        if NOVELTY_COLUMNS in graph.constants:
            changed |= _novelty_rows(graph, vectors)
    digest = hashlib.sha256(info.data_digest.encode() + vectors.tobytes()).hexdigest()
    trials = tuple(printable(Path(name).stem) for name in names)
    after = replace(
        info,
        rows=info.rows + len(names),
        trials=(*info.trials, *trials) if info.trials else (),
        taught=info.taught + len(names),
        data_digest=digest,
    )
    metadata = {METADATA_KEY: to_json(after)}
    return rewritten(model.contents.data, changed, metadata)


def _check_reach(model: Model, name: str, trial: Floats) -> None:
    """Refuse a trial (decision points, width) far outside those of the model."""
    for point, vector in enumerate(trial):
        with about(name):
            decisions = model.decide(vector, point)
        if any(decision.out_of_range for decision in decisions.values()):
            raise _far_outside(name)


def _far_outside(name: str) -> InputError:
    return InputError(
        f"{name}: lies far outside the trials that the model was fitted on, so its "
        "projection cannot place it; export a model with it"
    )


def within_reach(graph: Graph, task: str, z: Floats) -> Booleans:
    """(m,) which trials at coordinates z (points, m, components) may become rows.

    Squared distances add up exactly, as long as no row is longer than the longest row
    of training may be: half of what the coordinates of a query are clipped at, see
    `train.model.projection.coordinate_bits`.
    """
    nodes = graph.path(coordinates_of(graph, task))
    clips = [node for node in nodes if node.operator == "Clip"]
    highest = clips[-1].inputs[2]
    limits = [_value(graph, highest, point) for point in range(len(z))]
    longest = 0.5 * np.reshape(limits, (len(z), 1))
    lengths = (z**2).sum(axis=2)
    return np.asarray((lengths <= longest**2).all(axis=0))


def _check_labels(info: ModelInfo, name: str, labels: Labels) -> None:
    """Refuse a trial without a label that the model knows."""
    tasks = info.tasks
    if any(labels.get(task) in entry.labels for task, entry in tasks.items()):
        return
    examples = []
    questions = ""
    for task, entry in tasks.items():
        examples.append(f"{task}: {', '.join(entry.labels[:6])}")
        questions += spelled_like(labels.get(task, ""), entry.labels)
    raise InputError(
        f"{name}: has no label that the model knows ({'; '.join(examples)}); label it, "
        f"or teach it with --new-labels{questions}"
    )


def _novelty_rows(graph: Graph, vectors: Floats) -> dict[str, Array]:
    """The constants of the novelty's rows with further ones.

    A trial beyond the reach of the stored type is placed at its edge.
    """
    product = _reader(graph, NOVELTY_LENGTHS)
    if product.operator == "Gather":  # by decision point
        product = _reader(graph, product.outputs[0])
    y = _values(graph, product.inputs[0], vectors)
    limits = np.iinfo(graph.constants[NOVELTY_COLUMNS].dtype)
    columns = np.clip(-2.0 * y.swapaxes(1, 2), limits.min + 1, limits.max - 1)
    lengths = (0.25 * columns**2).sum(axis=1)
    return _extended(graph, {NOVELTY_COLUMNS: columns, NOVELTY_LENGTHS: lengths})


def _reader(graph: Graph, name: str) -> Node:
    """The first node that takes a value."""
    return next(node for node in graph.makers.values() if name in node.inputs)


def _values(graph: Graph, name: str, vectors: Floats) -> Floats:
    """(points, m, ...) a value of the graph for vectors (points, m, width)."""
    points = enumerate(vectors)
    return np.stack([_value(graph, name, point, features=x) for point, x in points])


def _value(graph: Graph, name: str, point: int, **inputs: Floats) -> Floats:
    """A value of the graph at a decision point."""
    return graph.run([name], {"decision_point": np.array([point]), **inputs})[0]


def _rows(graph: Graph, task: str, z: Floats, indices: Integers) -> dict[str, Array]:
    """The constants of a task's rows with further ones at coordinates `z`.

    A trial without a label for the task is infinitely far away.
    """
    labelled = indices >= 0
    lengths = np.where(labelled, (z**2).sum(axis=2), np.inf)
    further = {
        f"columns of {task}": -2.0 * z.swapaxes(1, 2) * labelled,
        f"lengths of {task}": lengths,
        f"labels of {task}": indices,
    }
    return _extended(graph, further)


def _extended(graph: Graph, further: Mapping[str, Array]) -> dict[str, Array]:
    """Constants with further values along their last axis."""
    changed = {}
    for name, values in further.items():
        former = graph.constants[name]
        shape = *former.shape[:-1], values.shape[-1]
        shaped = values.reshape(shape).astype(former.dtype)
        changed[name] = np.concatenate([former, shaped], axis=-1)
    return changed


def _votes(
    model: Model,
    graph: Graph,
    entry: Task,
    task: str,
    rows: Mapping[str, Array],
) -> dict[str, Array]:
    """The constants that count a task's labels, where its rows change them."""
    classes = len(entry.labels)
    tables: dict[str, Array] = {}
    if classes > len(model.info.tasks[task].labels):
        tables["ballots"] = np.eye(classes + 1, classes)
        tables["k"] = np.array([entry.k])
    if f"members of {task}" in graph.constants:
        tables |= label_tables(rows[f"labels of {task}"], classes)
    changed = {}
    for key, table in tables.items():
        name = f"{key} of {task}"
        changed[name] = table.astype(graph.constants[name].dtype)
    return changed
