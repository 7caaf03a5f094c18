"""A fitted `ContactClassifier` as one ONNX graph, through skl2onnx with our own
converter.

skl2onnx's own k-NN walks the training rows in a Scan, which is slow, breaks ties by the
class number and answers NaN with the first row's label. This graph takes all distances
in one product of whole numbers, obeys the tie rule, and answers a vector that is not
finite with label -1.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import onnx
from onnx import helper, numpy_helper
from skl2onnx import convert_sklearn, update_registered_converter
from skl2onnx.common.data_types import DoubleTensorType, Int64TensorType

from edge.arrays import Booleans, Floats, Integers
from edge.model import onnx_file
from edge.model.info import METADATA_KEY, ModelInfo
from edge.model.metadata import to_json
from export.build import OPSET, Builder, project, widened
from train.model.novelty import (
    CLIP,
    FARTHEST,
    STEP_BITS,
    NoveltyPoint,
    NoveltySpace,
)
from train.model.pipeline import ContactClassifier, FittedSpace, nearest_of_label
from train.model.stopping import SequentialClassifier

IR_VERSION = 8
DIGEST = b"rX\n\x14edge-classify-digest\x12@"
"""Begins the field of the digest in a ModelProto: an entry of metadata of 64 digits."""
LARGEST = float(np.finfo(np.float64).max)
Fitted = ContactClassifier | SequentialClassifier


def _squares(
    build: Builder,
    task: str,
    z: str,
    rows: Sequence[Floats],
    components: Sequence[int],
    absent: Booleans,
) -> tuple[str, str]:
    """Squared distances (n, rows) of points z (n, c) to rows (rows, c), less |z|^2, and
    |z|^2.

    Those to `absent` trials (rows,), which have no label for the task, are infinite.

    All are whole numbers below 2^53 (`train.model.projection.coordinate_bits`), so that |b|^2
    - 2 b.z cancels nothing. Of more coordinates than the `components` of a decision
    point the others count as 0: the tasks of a space share its rows.
    """
    width = rows[0].shape[1]
    if min(components) < width:
        masks = [(np.arange(width) < c).astype(np.float64) for c in components]
        z = build.node("Mul", z, build.by_decision_point(masks))
    columns = build.by_decision_point_small(
        [-2.0 * r.T for r in rows], f"columns of {task}"
    )
    lengths = []
    for r, c in zip(rows, components, strict=True):
        squares = (r[:, :c] ** 2).sum(axis=1)
        lengths.append(np.where(absent, np.inf, squares))
    subtrahend = build.by_decision_point(lengths, f"lengths of {task}")
    length = build.squared_length(z)
    return build.node("Gemm", z, columns, subtrahend), length


def _vote(
    build: Builder,
    task: str,
    labels: Integers,
    classes: int,
    neighbours: str,
    k: int,
    off: str,
) -> None:
    """Nodes from a task's neighbours to its label and its scores.

    Args:
        build: takes the nodes.
        task: its name.
        labels: (rows,) of the training trials; -1 where one has none.
        classes: how many labels there are.
        neighbours: name of the rows (n, k) of the neighbours.
        k: how many they are.
        off: name of the excess over the limits (n, 1).
    """
    trial_labels = build.constant(labels, f"labels of {task}")
    voters = build.node("Gather", trial_labels, neighbours)
    # A vector that is not finite has no votes: class -1, whose row of the votes (the
    # last) is 0.
    finite = build.node("LessOrEqual", off, LARGEST)
    voters = build.node("Where", finite, voters, -1)
    ballots = build.constant(np.eye(classes + 1, classes), f"ballots of {task}")
    label = f"{task}_label"
    scores = f"{task}_scores"
    if k <= 2:
        # Two neighbours agree or tie: either way the nearest decides.
        build.node("Gather", voters, 0, output=label, axis=1)
    if k == 1:
        build.node("Gather", ballots, label, output=scores)
        return
    cast = build.node("Gather", ballots, voters)
    build.node("ReduceMean", cast, [1], output=scores, keepdims=0)
    if k > 2:
        # The first neighbour whose class has the most votes is the nearest of the tied.
        votes_of_voters = build.node("GatherElements", scores, voters, axis=1)
        winner = build.node("ArgMax", votes_of_voters, axis=1, keepdims=1)
        build.node("GatherND", voters, winner, output=label, batch_dims=1)


def _convert(scope: Any, operator: Any, container: Any) -> None:
    model: Fitted = operator.raw_operator
    points = (
        model.decision_points_ if isinstance(model, SequentialClassifier) else [model]
    )
    build = Builder(scope, container)
    names = {output.raw_name: output.full_name for output in operator.outputs}
    x = operator.inputs[0].full_name
    if isinstance(model, SequentialClassifier):
        build.decision_point = build.node("Squeeze", operator.inputs[1].full_name)
    projected: dict[Spaces, tuple[str, str]] = {}
    for task in model.choices:
        spaces = _spaces(points, task)
        if spaces not in projected:
            projected[spaces] = _projected(build, x, points, spaces)
    _out_of_range(build, [off for _, off in projected.values()], names["out_of_range"])
    if isinstance(model, SequentialClassifier):
        _doubt(build, x, model.space_, names)
    for task in model.choices:
        _task(build, points, task, projected[_spaces(points, task)], names)


Spaces = tuple[FittedSpace, ...]
"""The space of a task at each decision point. Tasks whose spaces are equal at every one
share the nodes of a projection."""


def _spaces(points: Sequence[ContactClassifier], task: str) -> Spaces:
    return tuple(point.tasks_[task].space for point in points)


def _projected(
    build: Builder,
    x: str,
    points: Sequence[ContactClassifier],
    spaces: Spaces,
) -> tuple[str, str]:
    """Nodes that project features x to a task's spaces; see `project`."""
    projections = [space.projection for space in spaces]
    columns = [space.columns for space in spaces]
    width = points[-1].n_features_in_
    z, off = project(build, x, width, projections, columns)
    if min(map(len, columns)) < width:
        # A feature that another task or decision point takes must be finite too.
        zeros = build.node("Mul", x, 0.0)
        off = build.node("Add", off, build.node("ReduceL1", zeros, [1], keepdims=1))
    return z, off


def _task(
    build: Builder,
    points: Sequence[ContactClassifier],
    task: str,
    projected: tuple[str, str],
    names: Mapping[str, str],
) -> None:
    """Nodes from coordinates to a task's outputs.

    Args:
        build: takes the nodes.
        points: the classifier of each decision point.
        task: its name.
        projected: names of the coordinates, and of the excess over the limits.
        names: {output: its name in the graph}.
    """
    trials = points[-1].n_trials_
    at_points = [point.tasks_[task] for point in points]
    last = at_points[-1]
    members = last.space.members
    units = [fitted.unit for fitted in at_points]
    rows = []
    for fitted in at_points:
        of_all = np.zeros((trials, fitted.space.rows.shape[1]))
        of_all[members] = fitted.space.rows / fitted.unit
        rows.append(of_all)
    labels = np.full(trials, -1)
    labels[members] = last.labels
    classes = len(last.classes)
    output = names[f"{task}_label"].removesuffix("_label")
    components = [point.choices[task].components for point in points]
    z, off = projected
    rows = widened(rows, max(row.shape[1] for row in rows))
    squares, length = _squares(build, output, z, rows, components, labels < 0)
    voters = build.constant([last.k], f"k of {output}")
    outputs = ["", names[f"{task}_neighbours"]]
    nearest, neighbours = build.nodes(
        "TopK",
        [squares, voters],
        outputs,
        largest=0,
        sorted=1,
    )
    roots = build.node("Sqrt", build.node("Add", nearest, length))
    scales = build.by_decision_point(units)
    build.node("Mul", roots, scales, output=f"{output}_distances")
    _vote(build, output, labels, classes, neighbours, last.k, off)
    if f"{task}_label_distances" in names:
        all_squares = build.node("Add", squares, length)
        scales = build.by_decision_point(
            [fitted.unit * fitted.slope for fitted in at_points]
        )
        roots = _label_distances(build, output, all_squares, labels, classes)
        build.node("Mul", roots, scales, output=names[f"{task}_label_distances"])


def _out_of_range(build: Builder, excesses: Sequence[str], output: str) -> None:
    """Nodes that say whether any space cut something off: 1, or 0.

    The excess (n, 1) itself is a sum of fractions, whose last bits depend on the order
    of summation. Whether it is above 0 does not.
    """
    most = excesses[0] if len(excesses) == 1 else build.node("Max", *excesses)
    within = build.node("LessOrEqual", most, 0.0)
    beyond = build.node("Where", within, 0.0, 1.0)
    build.node("Squeeze", beyond, [1], output=output)


def _doubt(
    build: Builder,
    x: str,
    space: NoveltySpace,
    names: Mapping[str, str],
) -> None:
    """Nodes that score how unlike all training trials features (n, p) are, by their
    novelty and remoteness; see `train.model.novelty`."""
    points = space.points
    means = build.by_decision_point_small([p.mean for p in points])
    centred = build.node("Sub", x, means)
    gains = build.by_decision_point_small([p.gain for p in points])
    rounded = build.node("Round", build.node("Mul", centred, gains))
    steps, _ = build.clipped(rounded, [CLIP * 2.0**STEP_BITS] * len(points))
    weights = build.stored([space.weights], np.int16)
    z = build.shifted("MatMul", steps, weights, [space.shift] * len(points))
    squares = build.squared_length(steps)
    outside = build.node("Sub", squares, build.squared_length(z))
    outside = build.node("Max", outside, 1.0)
    whitening = build.by_decision_point_small([p.whitening for p in points])
    y = build.shifted("MatMul", z, whitening, [p.shift for p in points])
    y, _ = build.clipped(y, [FARTHEST] * len(points))
    # Twice the rows, so that |row|^2 - 2 row.y needs no further product.
    columns = build.stored(
        [-2.0 * p.rows.T for p in points], np.int16, "columns of novelty"
    )
    squares = _apart(build, "novelty", y, y, columns, [p.rows for p in points])
    nearest = _nearest(build, squares, [p.nearness for p in points])
    score = build.node("Mul", build.node("Sqrt", outside), nearest)
    build.node("Squeeze", score, [1], output=names["novelty"])
    _remoteness(build, y, columns, points, names["remoteness"])


def _remoteness(
    build: Builder,
    y: str,
    columns: str,
    points: Sequence[NoveltyPoint],
    output: str,
) -> None:
    """Nodes from whitened coordinates y (n, c) to the remoteness."""
    weights = build.by_decision_point([p.weights for p in points])
    weighted = build.node("Mul", y, weights)
    # The rows are stored once: their weights stand beside those of y.
    factor = build.node("Mul", weighted, weights)
    rows = [p.rows * p.weights for p in points]
    squares = _apart(build, "remoteness", weighted, factor, columns, rows)
    root = _nearest(build, squares, [p.weighted_nearness for p in points])
    build.node("Squeeze", root, [1], output=output)


def _apart(
    build: Builder,
    name: str,
    y: str,
    factor: str,
    columns: str,
    rows: Sequence[Floats],
) -> str:
    """Name of the squared distances (n, rows) of points y (n, c) to the rows of each
    decision point, whose products with y are those of `factor` (n, c) with the
    columns."""
    lengths = build.by_decision_point(
        [(r**2).sum(axis=1) for r in rows], f"lengths of {name}"
    )
    squares = build.node("Gemm", factor, columns, lengths)
    return build.node("Add", squares, build.squared_length(y))


def _nearest(build: Builder, squares: str, nearness: Sequence[Floats]) -> str:
    """Name of the root (n, 1) of the smallest of squares (n, rows) times the nearness
    (rows,) at each decision point."""
    squares = build.node("Mul", squares, build.by_decision_point_small(nearness))
    nearest, _ = build.nodes("TopK", [squares, [1]], ["", ""], largest=0)
    return build.node("Sqrt", nearest)


def _label_distances(
    build: Builder,
    task: str,
    squares: str,
    labels: Integers,
    classes: int,
) -> str:
    """Name of `train.model.pipeline.label_distances` (n, labels) of squared distances (n,
    rows) to trials of labels (rows,), -1 where one has none."""
    sizes = np.bincount(labels[labels >= 0], minlength=classes)
    counts = nearest_of_label(sizes)
    # The trials of each label, filled up with a row that is infinitely far.
    members = np.full((classes, int(sizes.max())), len(labels))
    for label, size in enumerate(sizes):
        members[label, :size] = np.flatnonzero(labels == label)
    taken = np.arange(counts.max()) < counts[:, None]
    rows = build.constant(members, f"members of {task}")
    most = build.constant(counts.max(keepdims=True), f"most of {task}")
    is_vote = build.constant(taken, f"taken of {task}")
    divisors = build.constant(counts.astype(np.float64), f"counts of {task}")
    wider = build.node("Pad", squares, [0, 0, 0, 1], np.inf)
    squares_of_label = build.node("Gather", wider, rows, axis=1)
    nearest, _ = build.nodes(
        "TopK",
        [squares_of_label, most],
        ["", ""],
        axis=2,
        largest=0,
        sorted=1,
    )
    roots = build.node("Round", build.node("Sqrt", nearest))
    counted = build.node("Where", is_vote, roots, 0.0)
    total = build.node("ReduceSum", counted, [2], keepdims=0)
    return build.node("Div", total, divisors)


def _outputs(model: Fitted) -> dict[str, Any]:
    """{output: its type}; ONNX Runtime derives the sizes from the constants."""
    sequential = isinstance(model, SequentialClassifier)
    numbers = DoubleTensorType([None])
    table = DoubleTensorType([None, None])
    of_task = {
        "label": Int64TensorType([None]),
        "scores": table,
        "distances": table,
        "neighbours": Int64TensorType([None, None]),
    }
    if sequential or model.products_:
        of_task["label_distances"] = table
    outputs = {
        f"{task}_{name}": kind
        for task in model.choices
        for name, kind in of_task.items()
    }
    outputs["out_of_range"] = numbers
    if sequential:
        outputs |= {"novelty": numbers, "remoteness": numbers}
    return outputs


def _parse(
    scope: Any,
    model: Fitted,
    inputs: list[Any],
    custom_parsers: Any = None,
) -> list[Any]:
    operator = scope.declare_local_operator(type(model).__name__, model)
    for variable in inputs:
        operator.inputs.append(variable)
    for name, kind in _outputs(model).items():
        operator.outputs.append(scope.declare_local_variable(name, kind))
    return list(operator.outputs)


def _shapes(operator: Any) -> None:
    """Keep the types with which `_parse` declares the outputs."""


def to_onnx(model: Fitted, info: ModelInfo) -> bytes:
    """The fitted tasks and the metadata as a checked, self-contained ONNX file.

    A `SequentialClassifier` gives a second input, `decision_point` int64 (1,), whose
    default is the last one, and for each task the output `<task>_label_distances` (n,
    labels); see `edge.model.info`.
    """
    kind = type(model)
    update_registered_converter(
        kind,
        kind.__name__,
        _shapes,
        _convert,
        parser=_parse,
        overwrite=True,
    )
    inputs: list[tuple[str, Any]] = [("features", DoubleTensorType([None, info.width]))]
    if isinstance(model, SequentialClassifier):
        inputs.append(("decision_point", Int64TensorType([1])))
    proto = convert_sklearn(
        model,
        name="edge-classify",
        initial_types=inputs,
        target_opset={"": OPSET},
    )
    if isinstance(model, SequentialClassifier):
        # An initializer of an input's name is its default: whoever gives `features`
        # alone is answered at the full window.
        full = np.array([len(model.decision_points_) - 1], dtype=np.int64)
        proto.graph.initializer.append(numpy_helper.from_array(full, "decision_point"))
    proto.ir_version = IR_VERSION
    proto.producer_name = "edge-classify"
    proto.doc_string = "scaler, PCA and k-NN of a touch; see the metadata"
    helper.set_model_props(proto, {METADATA_KEY: to_json(info)})
    onnx.checker.check_model(proto, full_check=True)
    data: bytes = proto.SerializeToString(deterministic=True)
    onnx_file.check(onnx_file.read(data, "the exported model"), "the exported model")
    return with_digest(data)


def with_digest(data: bytes) -> bytes:
    """A model's bytes, and after them the digest by which a change is noticed."""
    with_key = data + DIGEST
    return with_key + hashlib.sha256(with_key).hexdigest().encode()
