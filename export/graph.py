"""A fitted model as one ONNX graph, through skl2onnx with our own converter.

skl2onnx's own k-NN walks the training rows in a Scan, which is slow, breaks ties by the
class number and answers NaN with the first row's label. This graph takes all distances
in one product of whole numbers, obeys the tie rule, and answers a vector that is not
finite with label -1.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import partial, reduce
from typing import Any, Protocol

import numpy as np
import onnx
from onnx import helper
from skl2onnx import convert_sklearn, update_registered_converter
from skl2onnx.common.data_types import DoubleTensorType, Int64TensorType

from edge.arrays import Booleans, Floats, Integers
from edge.decide.info import METADATA_KEY, ModelInfo
from edge.decide.metadata import to_json
from edge.decide.onnx_file import DIGEST, OPSET
from export.build import Builder, project, widened
from train.model.outlier_score import (
    CLIP,
    FARTHEST,
    STEP_BITS,
    OutlierPoint,
    OutlierSpace,
)
from train.model.pipeline import ContactClassifier, FittedSpace
from train.model.stopping import SequentialClassifier

IR_VERSION = 8
LARGEST = float(np.finfo(np.float64).max)


class FittedScorer(Protocol):
    """What was fitted by another module than those of `train.model` that stand here."""

    def add_nodes(self, build: Builder) -> None:
        """Add the nodes from `features` to all outputs of the model's metadata."""


Fitted = ContactClassifier | SequentialClassifier | FittedScorer


def _squares(
    build: Builder,
    name: str,
    y: str,
    factor: str,
    columns: str,
    lengths: Sequence[Floats],
) -> str:
    """Name of the squared distances (n, rows) of points y (n, c) to rows (rows, c).

    All are whole numbers, those of tasks below 2^53
    (`train.model.projection.coordinate_bits`), so that |row|^2 - 2 row.y + |y|^2
    cancels nothing.

    Args:
        build: takes the nodes.
        name: of the lengths.
        y: name of the points.
        factor: name of what gives -2 row.y when multiplied by the columns: the points,
            where no coordinate has a weight.
        columns: name of the rows, times -2, as columns.
        lengths: (rows,) |row|^2 at each decision point; infinite of a row that does not
            count.
    """
    summands = build.by_decision_point(lengths, name)
    squares = build.node("Gemm", factor, columns, summands)
    return build.node("Add", squares, build.squared_length(y))


def _squares_of_task(
    build: Builder,
    task: str,
    z: str,
    rows: Sequence[Floats],
    components: Sequence[int],
    absent: Booleans,
) -> str:
    """Name of the squared distances (n, rows) of points z (n, c) to rows (rows, c).

    Those to `absent` trials (rows,), which have no label for the task, are infinite. Of
    more coordinates than the `components` of a decision point the others count as 0:
    the tasks of a space share its rows.
    """
    width = rows[0].shape[1]
    if min(components) < width:
        masks = [(np.arange(width) < c).astype(np.float64) for c in components]
        z = build.node("Mul", z, build.by_decision_point(masks, f"mask of {task}"))
    coordinates = [-2.0 * r.T for r in rows]
    number = build.numbered(coordinates)
    build.constant(number, f"rows of {task}")
    columns = build.by_decision_point_small(
        coordinates, f"coordinates of rows {number}"
    )
    lengths = []
    for r, c in zip(rows, components, strict=True):
        squares = (r[:, :c] ** 2).sum(axis=1)
        lengths.append(np.where(absent, np.inf, squares))
    number = build.numbered(lengths)
    build.constant(number, f"lengths of {task}")
    return _squares(build, f"lengths of rows {number}", z, z, columns, lengths)


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
    largest = build.constant(LARGEST, "largest number")
    voters = build.node("Where", build.node("LessOrEqual", off, largest), voters, -1)
    ballots = build.constant(np.eye(classes + 1, classes), f"ballots of {classes}")
    label = f"{task}_label"
    scores = f"{task}_scores"
    if k <= 2:
        # Two neighbours agree or tie: either way the nearest decides.
        build.node("Gather", voters, 0, output=label, axis=1)
    cast = build.node("Gather", ballots, voters)
    build.node("ReduceMean", cast, [1], output=scores, keepdims=0)
    if k > 2:
        # The first neighbour whose class has the most votes is the nearest of the tied.
        votes_of_voters = build.node("GatherElements", scores, voters, axis=1)
        winner = build.node("ArgMax", votes_of_voters, axis=1, keepdims=1)
        build.node("GatherND", voters, winner, output=label, batch_dims=1)


def _nearest_trials(
    build: Builder,
    model: ContactClassifier | SequentialClassifier,
    has_label_distances: bool,
) -> None:
    """Nodes from `features` and, with decision points, `decision_point` to all
    outputs."""
    points: Sequence[ContactClassifier]
    if isinstance(model, SequentialClassifier):
        points = model.decision_points_
        build.decision_point = build.node("Squeeze", "decision_point")
        # An initializer of an input's name is its default: whoever gives `features`
        # alone is answered at the full window.
        build.constant([len(points) - 1], "decision_point")
    else:
        points = [model]
    projected: dict[Spaces, tuple[str, str]] = {}
    for task in model.choices:
        spaces = _spaces(points, task)
        if spaces not in projected:
            width = points[-1].n_features_in_
            projected[spaces] = project(build, spaces, width, len(projected))
        build.constant(list(projected).index(spaces), f"space of {task}")
    by_point = zip(*projected, strict=True)
    units = build.by_decision_point(
        [[space.projection.grid_.unit for space in spaces] for spaces in by_point],
        "units",
    )
    # The excess itself is a sum of fractions, whose last bits depend on the order of
    # summation. Whether it is above 0 does not.
    excesses = [off for _, off in projected.values()]
    most = reduce(partial(build.node, "Max"), excesses)
    within = build.node("LessOrEqual", most, 0.0)
    beyond = build.node("Where", within, 0.0, 1.0)
    build.node("Squeeze", beyond, [1], output="out_of_range")
    if isinstance(model, SequentialClassifier):
        _doubt(build, model.space_)
    for task in model.choices:
        unit = build.node("Gather", units, f"space of {task}", axis=0)
        of_task = (*projected[_spaces(points, task)], unit)
        _task(build, points, task, of_task, has_label_distances)


Spaces = tuple[FittedSpace, ...]
"""The space of a task at each decision point. Tasks whose spaces are equal at every one
share the nodes of a projection."""


def _spaces(points: Sequence[ContactClassifier], task: str) -> Spaces:
    return tuple(point.tasks_[task].space for point in points)


def _task(
    build: Builder,
    points: Sequence[ContactClassifier],
    task: str,
    projected: tuple[str, str, str],
    has_label_distances: bool,
) -> None:
    """Nodes from coordinates to a task's outputs.

    Args:
        build: takes the nodes.
        points: the classifier of each decision point.
        task: its name.
        projected: names of the coordinates, of the excess over the limits, and of the
            coordinates' unit.
        has_label_distances: whether something goes by them.
    """
    count = points[-1].n_rows_
    at_points = [point.tasks_[task] for point in points]
    last = at_points[-1]
    members = last.space.members
    rows = []
    for fitted in at_points:
        of_all = np.zeros((count, fitted.space.rows.shape[1]))
        of_all[members] = fitted.space.rows / fitted.unit
        rows.append(of_all)
    labels = np.full(count, -1)
    labels[members] = last.labels
    components = [point.choices[task].components for point in points]
    z, off, unit = projected
    rows = widened(rows, max(row.shape[1] for row in rows))
    squares = _squares_of_task(build, task, z, rows, components, labels < 0)
    outputs = ["", f"{task}_neighbours"]
    k = build.constant([last.k], f"k of {task}")
    nearest, neighbours = build.nodes("TopK", [squares, k], outputs, largest=0)
    build.node("Mul", build.node("Sqrt", nearest), unit, output=f"{task}_distances")
    _vote(build, task, labels, len(last.classes), neighbours, last.k, off)
    if has_label_distances:
        scales = [fitted.unit * fitted.slope for fitted in at_points]
        _label_distances(build, task, squares, labels, last.counts, scales)


def _doubt(build: Builder, space: OutlierSpace) -> None:
    """Nodes that score how unlike all training trials features (n, p) are, by their
    the outlier score and the distance to known objects; see
    `train.model.outlier_score`."""
    points = space.points
    means = build.by_decision_point_small([p.mean for p in points], "outlier means")
    centred = build.node("Sub", "features", means)
    gains = build.by_decision_point_small([p.gain for p in points], "outlier gains")
    rounded = build.node("Round", build.node("Mul", centred, gains))
    most = [CLIP * 2.0**STEP_BITS]
    steps, _ = build.clipped(rounded, most, "outlier most steps")
    weights = build.by_decision_point_small([space.weights], "outlier weights")
    z = build.shifted(steps, weights, [space.shift], "outlier factor")
    squares = build.squared_length(steps)
    outside = build.node("Sub", squares, build.squared_length(z))
    outside = build.node("Max", outside, 1.0)
    whitening = build.by_decision_point_small(
        [p.whitening for p in points], "outlier whitening"
    )
    shifts = [p.shift for p in points]
    y = build.shifted(z, whitening, shifts, "outlier whitening factors")
    y, _ = build.clipped(y, [FARTHEST], "outlier limit")
    # Twice the rows, so that |row|^2 - 2 row.y needs no further product.
    columns = build.by_decision_point_small(
        [-2.0 * p.rows.T for p in points], "outlier coordinates"
    )
    lengths = [(p.rows**2).sum(axis=1) for p in points]
    squares = _squares(build, "outlier lengths", y, y, columns, lengths)
    nearest = _nearest(build, squares, [p.nearness for p in points], "outlier nearness")
    score = build.node("Mul", build.node("Sqrt", outside), nearest)
    build.node("Squeeze", score, [1], output="outlier_score")
    _known_distance(build, y, columns, points)


def _known_distance(
    build: Builder,
    y: str,
    columns: str,
    points: Sequence[OutlierPoint],
) -> None:
    """Nodes from whitened coordinates y (n, c) to the distance to known objects."""
    weights = build.by_decision_point([p.weights for p in points], "known weights")
    weighted = build.node("Mul", y, weights)
    # The rows are stored once: their weights stand beside those of y.
    factor = build.node("Mul", weighted, weights)
    lengths = [((p.rows * p.weights) ** 2).sum(axis=1) for p in points]
    squares = _squares(build, "known lengths", weighted, factor, columns, lengths)
    nearness = [p.weighted_nearness for p in points]
    root = _nearest(build, squares, nearness, "known nearness")
    build.node("Squeeze", root, [1], output="known_distance")


def _nearest(
    build: Builder, squares: str, nearness: Sequence[Floats], name: str
) -> str:
    """Name of the root (n, 1) of the smallest of squares (n, rows) times the nearness
    (rows,), which has a name, at each decision point."""
    factors = build.by_decision_point_small(nearness, name)
    squares = build.node("Mul", squares, factors)
    nearest, _ = build.nodes("TopK", [squares, [1]], ["", ""], largest=0)
    return build.node("Sqrt", nearest)


def _label_distances(
    build: Builder,
    task: str,
    squares: str,
    labels: Integers,
    counts: Integers,
    scales: Sequence[float],
) -> None:
    """Nodes for `train.model.pipeline.label_distances` (n, labels).

    Args:
        build: takes the nodes.
        task: its name.
        squares: name of the squared distances (n, rows).
        labels: (rows,) of the rows; -1 where one has none.
        counts: (labels,) rows that stand for each.
        scales: of the distances at each decision point.
    """
    sizes = np.bincount(labels[labels >= 0])
    # The rows of each label, filled up with a row that is infinitely far.
    members = np.full((len(sizes), int(sizes.max())), len(labels))
    for label, size in enumerate(sizes):
        members[label, :size] = np.flatnonzero(labels == label)
    is_nearest = np.arange(counts.max()) < counts[:, None]
    places = build.constant(members, f"members of {task}")
    wider = build.node("Pad", squares, [0, 0, 0, 1], np.inf)
    squares_of_label = build.node("Gather", wider, places, axis=1)
    most = build.constant(counts.max(keepdims=True), f"most of {task}")
    nearest, _ = build.nodes(
        "TopK", [squares_of_label, most], ["", ""], axis=2, largest=0
    )
    roots = build.node("Round", build.node("Sqrt", nearest))
    counts_of_label = build.constant(is_nearest, f"nearest of {task}")
    counted = build.node("Where", counts_of_label, roots, 0.0)
    total = build.node("ReduceSum", counted, [2], keepdims=0)
    divisors = build.constant(counts.astype(np.float64), f"counts of {task}")
    distances = build.node("Div", total, divisors)
    factors = build.by_decision_point(scales, f"scales of {task}")
    build.node("Mul", distances, factors, output=f"{task}_label_distances")


class _Converter:
    """What skl2onnx asks of a converter, for the outputs of a model's metadata."""

    def __init__(self, info: ModelInfo) -> None:
        self._info = info

    def parse(
        self, scope: Any, model: Fitted, inputs: list[Any], custom_parsers: Any = None
    ) -> Any:
        """Declare the outputs; ONNX Runtime derives their sizes from the constants."""
        operator = scope.declare_local_operator(type(model).__name__, model)
        operator.inputs.extend(inputs)
        for name, (element, shape) in self._info.outputs.items():
            kind = Int64TensorType if element == "int64" else DoubleTensorType
            variable = scope.declare_local_variable(name, kind([None, *shape]))
            operator.outputs.append(variable)
        return operator.outputs

    def shapes(self, operator: Any) -> None:
        """Keep the types with which `parse` declares the outputs."""

    def convert(self, scope: Any, operator: Any, container: Any) -> None:
        """Add the nodes and constants."""
        build = Builder()
        model = operator.raw_operator
        if isinstance(model, ContactClassifier | SequentialClassifier):
            _nearest_trials(build, model, self._info.has_label_distances)
        else:
            model.add_nodes(build)
        container.nodes.extend(build.made)
        container.initializers.extend(build.constants.values())
        container.node_domain_version_pair_sets.add(("", OPSET))


def to_onnx(model: Fitted, info: ModelInfo) -> bytes:
    """The fitted tasks and the metadata as a checked, self-contained ONNX file.

    A `SequentialClassifier` gives a second input, `decision_point` int64 (1,), whose
    default is the last one, and for each task the output `<task>_label_distances` (n,
    labels); see `edge.decide.info`.
    """
    inputs: list[tuple[str, Any]] = [("features", DoubleTensorType([None, info.width]))]
    if info.decision_points_s:
        inputs.append(("decision_point", Int64TensorType([1])))
    kind = type(model)
    converter = _Converter(info)
    update_registered_converter(
        kind,
        kind.__name__,
        converter.shapes,
        converter.convert,
        parser=converter.parse,
        overwrite=True,
    )
    proto = convert_sklearn(
        model, name="edge-classify", initial_types=inputs, target_opset={"": OPSET}
    )
    proto.ir_version = IR_VERSION
    proto.producer_name = "edge-classify"
    proto.doc_string = "scaler, PCA and k-NN of a touch; see the metadata"
    helper.set_model_props(proto, {METADATA_KEY: to_json(info)})
    onnx.checker.check_model(proto, full_check=True)
    return with_digest(proto.SerializeToString(deterministic=True))


def with_digest(data: bytes) -> bytes:
    """A model's bytes, and after them the digest by which a change is noticed."""
    with_key = data + DIGEST
    return with_key + hashlib.sha256(with_key).hexdigest().encode()
