"""A fitted `ContactClassifier` as one ONNX graph, through skl2onnx with our own converter.

skl2onnx's own k-NN walks the training rows in a Scan (slow), breaks ties by the class number and
answers NaN with the first row's label. This graph measures distances directly, in float64,
obeys the tie rule, and answers what is not finite with label -1.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from skl2onnx import convert_sklearn, update_registered_converter
from skl2onnx.common.data_types import DoubleTensorType, Int64TensorType

from edge.model.info import METADATA_KEY, ModelInfo
from edge.model.onnx_file import check
from export.build import OPSET, Builder, project, widened
from train.distance import resolution
from train.pipeline import ContactClassifier, Space, nearest_of_label
from train.projection import HALF_BITS
from train.stopping import SequentialClassifier

IR_VERSION = 8
LARGEST = float(np.finfo(np.float64).max)
SHORTLIST_ROWS = 1024
"""Training rows from which on a float32 product picks a shortlist that is measured exactly."""
SHORTLIST = 24
"""How many more rows than voters a shortlist has, so that its check rarely fails."""
FLOAT32_FIT = (2.0**-16, 2.0**16)
"""Lengths of rows whose float32 squares and products need no scaling."""


def _gaps(build: Builder, z: str, rows: Sequence[NDArray[np.float64]]) -> str:
    """Differences (n, c, rows) of the training rows (rows, c) from points (n, c)."""
    columns = build.by_decision_point(
        [r.T for r in rows]
    )  # (c, rows): sums over c then run along memory
    return build.node("Sub", [columns, build.node("Unsqueeze", [z, build.ints(2)])])


def _running(build: Builder, gaps: str, axis: int) -> str:
    """`train.distance.running_squares` of differences, along the axis of their components."""
    return build.node("CumSum", [build.node("Mul", [gaps, gaps]), build.constant(axis, np.int64)])


def _by_first(build: Builder, running: str, components: int, axis: int) -> str:
    """Squared distances by so many components; 0 by none."""
    if components == 0:
        return build.node("ReduceSum", [running, build.ints(axis)], keepdims=0)
    return build.node("Gather", [running, build.constant(components - 1, np.int64)], axis=axis)


def _nearest(build: Builder, squares: str, k: int) -> list[str]:
    """Squared distances and rows (n, k) of the nearest, every row measured directly."""
    return build.nodes("TopK", [squares, build.ints(k)], ["", ""], largest=0, sorted=1)


def _unit(rows: NDArray[np.float64]) -> float:
    """The power of two that brings the longest row near length 1; 1 where float32 needs none.

    A float32 square vanishes below 1e-23 and overflows above 1.8e19.
    """
    longest = float(np.sqrt((rows**2).sum(axis=1)).max(initial=0.0))
    if longest == 0.0 or FLOAT32_FIT[0] <= longest <= FLOAT32_FIT[1]:
        return 1.0
    return math.ldexp(1.0, 1 - math.frexp(longest)[1])


def _shortlisted(build: Builder, z: str, rows: Sequence[NDArray[np.float64]], k: int) -> list[str]:
    """As `_nearest`, where a float32 product first picks the rows worth measuring.

    With b a training row and q the query, |b - q|^2 - |q|^2 = |b|^2 - 2 b.q is computed in
    float32 with an error of at most e = u (2 B^2 + |q|^2), where B is the longest row and
    u = (c + 8) 2^-23 covers the c products, their sum and the three conversions (Higham,
    Accuracy and Stability, section 3.1). Every row outside the shortlist is at least as far as
    its last entry says, less e; where the k-th measured distance is below that, no row outside
    can be among the k nearest. Where it is not (many near-duplicates), all rows are measured.
    That holds as long as float32 neither overflows nor loses squares, so rows of another size
    are scaled by a power of two first.
    """
    c = rows[0].shape[1]
    units = [_unit(r) for r in rows]
    scaled = any(unit != 1.0 for unit in units)
    if scaled:
        rows = [r * unit for r, unit in zip(rows, units, strict=True)]
        z = build.node("Mul", [z, build.by_decision_point(units)])
    lengths = [(r**2).sum(axis=1) for r in rows]
    u = (c + 8) * 2.0**-23
    slack = [2.0 * u * float(of.max()) for of in lengths]
    count = k + SHORTLIST

    ints = build.ints
    single = build.node("Cast", [z], to=TensorProto.FLOAT)
    product = build.node(
        "MatMul", [single, build.by_decision_point([-2.0 * r.T for r in rows], np.float32)]
    )
    rough = build.node("Add", [product, build.by_decision_point(lengths, np.float32)])
    values, picked = build.nodes("TopK", [rough, ints(count)], ["", ""], largest=0, sorted=1)
    # In the order of the rows, so that equal distances go to the earlier one.
    ordered, _ = build.nodes("TopK", [picked, ints(count)], ["", ""], largest=0, sorted=1)
    near = build.node("Gather", [build.by_decision_point(rows), ordered], axis=0)
    gaps = build.node("Sub", [near, build.node("Unsqueeze", [z, ints(1)])])
    squares = _by_first(build, _running(build, gaps, 2), c, 2)
    short, order = build.nodes("TopK", [squares, ints(k)], ["", ""], largest=0, sorted=1)
    found = build.node("GatherElements", [ordered, order], axis=1)
    kth = build.node("Slice", [short, ints(k - 1), ints(k), ints(1)])
    last = build.node("Slice", [values, ints(count - 1), ints(count), ints(1)])
    length = build.node("ReduceSumSquare", [z, ints(1)], keepdims=1)
    reach = build.node(
        "Add",
        [
            build.node("Cast", [last], to=TensorProto.DOUBLE),
            build.node("Mul", [length, build.constant(1.0 - u)]),
        ],
    )
    sure = build.node("Less", [build.node("Add", [kth, build.by_decision_point(slack)]), reach])
    flags = build.node("Cast", [sure], to=TensorProto.FLOAT)
    all_sure = build.node("ReduceMin", [flags, ints(0, 1)], keepdims=0)
    kinds = {"squares": (TensorProto.DOUBLE, 2), "rows": (TensorProto.INT64, 2)}
    then = build.branch("shortlisted", kinds, lambda: [short, found])
    other = build.branch(
        "measured",
        kinds,
        lambda: _nearest(
            build, _by_first(build, _running(build, _gaps(build, z, rows), 1), c, 1), k
        ),
    )
    near_squares, near_rows = build.nodes(
        "If",
        [build.node("Cast", [all_sure], to=TensorProto.BOOL)],
        ["", ""],
        then_branch=then,
        else_branch=other,
    )
    if scaled:
        near_squares = build.node(
            "Mul", [near_squares, build.by_decision_point([u**-2 for u in units])]
        )
    return [near_squares, near_rows]


def _first(build: Builder, values: str, have: int, want: int, output: str = "") -> str:
    """The first `want` of `have` columns; where there are fewer, one more that is infinite.

    Those of a task's output are named `output`.
    """
    if have < want:
        return build.node("Pad", [values, build.ints(0, 0, 0, 1), build.constant(np.inf)], output)
    if have == want:
        return build.node("Identity", [values], output) if output else values
    ints = [build.ints(i) for i in (0, want, 1)]
    return build.node("Slice", [values, *ints], output)


def _decide(
    build: Builder, task: str, labels: NDArray[np.int64], classes: int, k: int, near: list[str]
) -> None:
    """Squared distances (n, k + 1) and rows (n, k) to a task's outputs."""
    squares, rows = near
    roots = build.node("Sqrt", [squares])
    distances, _ = build.nodes(
        "Split", [roots, build.ints(k, 1)], [f"{task}_distances", f"{task}_next"], axis=1
    )
    said = build.node("Gather", [build.constant(labels, np.int64), rows])
    # A distance that is no number, or none that float64 holds, votes for nothing: class -1,
    # whose row of the votes (the last one) is empty.
    known = build.node("LessOrEqual", [distances, build.constant(LARGEST)])
    said = build.node("Where", [known, said, build.constant(-1, np.int64)])
    ballots = build.constant(np.vstack([np.eye(classes), np.zeros((1, classes))]))
    if k <= 2:
        # Two neighbours agree or tie: either way the nearest has it.
        said_first = [said, build.constant(0, np.int64)]
        label = build.node("Gather", said_first, f"{task}_label", axis=1)
    if k == 1:
        build.node("Gather", [ballots, label], f"{task}_scores")
        return
    cast = build.node("Gather", [ballots, said])
    votes = build.node("ReduceMean", [cast, build.ints(1)], f"{task}_scores", keepdims=0)
    if k == 2:
        return
    # The first neighbour whose class has the most votes is the nearest of the tied.
    own = build.node("GatherElements", [votes, said], axis=1)
    first = build.node("ArgMax", [own], axis=1, keepdims=1)
    build.node("GatherND", [said, first], f"{task}_label", batch_dims=1)


def _decision_points(model: ContactClassifier | SequentialClassifier) -> list[ContactClassifier]:
    return model.decision_points_ if isinstance(model, SequentialClassifier) else [model]


def _convert(scope: Any, operator: Any, container: Any) -> None:
    model: ContactClassifier | SequentialClassifier = operator.raw_operator
    decision_points = _decision_points(model)
    last = decision_points[-1]
    build = Builder(scope, container)
    names = {output.raw_name: output.full_name for output in operator.outputs}
    x = operator.inputs[0].full_name
    if len(operator.inputs) > 1:
        build.decision_point = build.node("Squeeze", [operator.inputs[1].full_name])
    kept = {
        task: max(decision_point.components_[task] for decision_point in decision_points)
        for task in model.choices
    }
    groups: dict[tuple[Space, int], str] = {}
    for task, choice in model.choices.items():
        key = (choice.space(task), kept[task])
        if key not in groups or choice.k > model.choices[groups[key]].k:
            groups[key] = task
    alone = names["reach"] if len(last.projections_) == 1 else ""
    projected = {
        space: project(
            build,
            build.taken(x, last.columns_[space], last.n_features_in_),
            [m.projections_[space] for m in decision_points],
            alone,
        )
        for space in last.projections_
    }
    points = {space: z for space, (z, _) in projected.items()}
    if not alone:
        build.node("Max", [reach for _, reach in projected.values()], names["reach"])
    tasks = {task: names[f"{task}_label"].removesuffix("_label") for task in model.choices}
    near: dict[tuple[Space, int], list[str]] = {}
    running: dict[Space, str] = {}
    all_squares: dict[tuple[Space, int], str] = {}
    early = isinstance(model, SequentialClassifier)
    for (space, components), most in groups.items():
        rows = widened([m.rows_[space] for m in decision_points])
        # The one after those that vote shows how near it came.
        have, k = rows[0].shape[1], min(model.choices[most].k + 1, len(rows[0]))
        # A shortlist of most rows saves nothing, nor does one where each label's distance is asked.
        if not early and len(rows[0]) >= SHORTLIST_ROWS and 2 * (k + SHORTLIST) <= len(rows[0]):
            z = _first(build, points[space], have, components)
            found = _shortlisted(build, z, [r[:, :components] for r in rows], k)
        else:
            if space not in running:
                running[space] = _running(build, _gaps(build, points[space], rows), 1)
            measured = _by_first(build, running[space], components, 1)
            all_squares[space, components] = measured
            found = _nearest(build, measured, k)
        near[space, components] = found
    for task, choice in model.choices.items():
        key = (choice.space(task), kept[task])
        have = min(model.choices[groups[key]].k + 1, len(last.labels_[task]))
        squares, rows_of = near[key]
        rows_of = _first(build, rows_of, have, choice.k, f"{tasks[task]}_neighbours")
        squares = _first(build, squares, have, choice.k + 1)
        classes = len(last.classes_[task])
        _decide(build, tasks[task], last.labels_[task], classes, choice.k, [squares, rows_of])
        if early:
            labels, output = last.labels_[task], names[f"{task}_label_distances"]
            _label_distances(build, all_squares[key], labels, classes, output)


def _label_distances(
    build: Builder, squares: str, labels: NDArray[np.int64], classes: int, output: str
) -> None:
    """(n, labels) of squared distances (n, rows): `train.pipeline.label_distances`."""
    sizes = np.bincount(labels, minlength=classes)
    counts = nearest_of_label(sizes)
    # A label's rows, filled up with one more column that is infinitely far away.
    rows = np.full((classes, int(sizes.max())), len(labels))
    for label, size in enumerate(sizes):
        rows[label, :size] = np.flatnonzero(labels == label)
    ints = build.ints
    wider = build.node("Pad", [squares, ints(0, 0, 0, 1), build.constant(np.inf)])
    own = build.node("Gather", [wider, build.constant(rows, np.int64)], axis=1)
    nearest, _ = build.nodes(
        "TopK", [own, ints(int(counts.max()))], ["", ""], axis=2, largest=0, sorted=1
    )
    there = np.arange(counts.max()) < counts[:, None]
    kept = build.node("Where", [build.constant(there, bool), nearest, build.constant(0.0)])
    total = build.node("ReduceSum", [kept, ints(2)], keepdims=0)
    build.node("Div", [total, build.constant(counts.astype(np.float64))], output)


def _resolution(model: ContactClassifier | SequentialClassifier, task: str) -> tuple[float, float]:
    """`train.distance.resolution` of a task, the coarsest of its decision points."""
    found = []
    for decision_point in _decision_points(model):
        projection = decision_point.projections_[decision_point.spaces_[task]]
        weights = projection.weights_[:, : decision_point.components_[task]]
        found.append(resolution(weights, projection.grid_.unit * 2.0**HALF_BITS))
    fixed, part = zip(*found, strict=True)
    return max(fixed), max(part)


def _outputs(model: ContactClassifier | SequentialClassifier) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for task, choice in model.choices.items():
        classes = len(_decision_points(model)[-1].classes_[task])
        found += [
            (f"{task}_label", Int64TensorType([None])),
            (f"{task}_scores", DoubleTensorType([None, classes])),
            (f"{task}_distances", DoubleTensorType([None, choice.k])),
            (f"{task}_neighbours", Int64TensorType([None, choice.k])),
            (f"{task}_next", DoubleTensorType([None, 1])),
        ]
        if isinstance(model, SequentialClassifier):
            found.append((f"{task}_label_distances", DoubleTensorType([None, classes])))
    found.append(("reach", DoubleTensorType([None])))
    return found


def _parse(
    scope: Any,
    model: ContactClassifier | SequentialClassifier,
    inputs: list[Any],
    custom_parsers: Any = None,
) -> list[Any]:
    operator = scope.declare_local_operator(type(model).__name__, model)
    for given in inputs:
        operator.inputs.append(given)
    for name, kind in _outputs(model):
        operator.outputs.append(scope.declare_local_variable(name, kind))
    return list(operator.outputs)


def _shapes(operator: Any) -> None:
    for variable, (_, kind) in zip(operator.outputs, _outputs(operator.raw_operator), strict=True):
        variable.set_type(kind)


def _captured(node: onnx.NodeProto) -> set[str]:
    """What a node reads, itself or in its branches."""
    names = set(node.input)
    for attribute in node.attribute:
        inside = attribute.g.node
        made = {name for inner in inside for name in inner.output}
        names |= {name for inner in inside for name in _captured(inner)} - made
    return names


def _in_order(nodes: list[onnx.NodeProto], known: set[str]) -> list[onnx.NodeProto]:
    """Nodes after those they read from; skl2onnx does not see what a branch reads."""
    made = {name for node in nodes for name in node.output}
    waiting, ordered, ready = list(nodes), [], set(known)
    while waiting:
        now = [node for node in waiting if _captured(node) & made <= ready]
        if not now:
            raise ValueError("the graph has a loop")
        waiting = [node for node in waiting if node not in now]
        ordered += now
        ready |= {name for node in now for name in node.output}
    return ordered


def to_onnx(model: ContactClassifier | SequentialClassifier, info: ModelInfo) -> bytes:
    """The fitted tasks and the metadata as a checked, self-contained ONNX file.

    A `SequentialClassifier` gives a second input, `decision_point` int64 (1,), which is the last
    where it is not given, and for each task the output `<task>_label_distances` (n, labels); see
    `edge.model.stopping`.
    """
    kind = type(model)
    update_registered_converter(
        kind, kind.__name__, _shapes, _convert, parser=_parse, overwrite=True
    )
    inputs: list[tuple[str, Any]] = [("features", DoubleTensorType([None, info.width]))]
    if isinstance(model, SequentialClassifier):
        inputs.append(("decision_point", Int64TensorType([1])))
    proto = convert_sklearn(
        model, name="edge-classify", initial_types=inputs, target_opset={"": OPSET}
    )
    nodes = _in_order(list(proto.graph.node), {name for name, _ in inputs})
    del proto.graph.node[:]
    proto.graph.node.extend(nodes)
    if isinstance(model, SequentialClassifier):
        # An initializer of an input's name is its default: whoever gives `features` alone is
        # answered at the full window.
        full = np.array([len(model.decision_points_) - 1], dtype=np.int64)
        proto.graph.initializer.append(numpy_helper.from_array(full, "decision_point"))
    info = replace(
        info,
        tasks={
            task: replace(entry, resolution=_resolution(model, task))
            for task, entry in info.tasks.items()
        },
    )
    proto.ir_version = IR_VERSION
    proto.producer_name = "edge-classify"
    proto.doc_string = "scaler, PCA and k-NN of a touch; see the metadata"
    helper.set_model_props(proto, {METADATA_KEY: info.to_json()})
    onnx.checker.check_model(proto, full_check=True)
    data: bytes = proto.SerializeToString(deterministic=True)
    check(data, "the exported model")
    return data
