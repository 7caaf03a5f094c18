"""A fitted `ContactClassifier` as one ONNX graph, through skl2onnx with our own converter.

skl2onnx's own k-NN walks the training rows in a Scan (slow), breaks ties by the class number and
answers NaN with the first row's label. This graph measures distances directly, in float64,
obeys the tie rule, and answers what is not finite with label -1.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from skl2onnx import convert_sklearn, update_registered_converter
from skl2onnx.common.data_types import DoubleTensorType, Int64TensorType

from edge.model import METADATA_KEY, ModelInfo
from edge.onnxfile import check
from train.pipeline import ContactClassifier, Projection

OPSET = 18
IR_VERSION = 8
LARGEST = float(np.finfo(np.float64).max)
SHORTLIST_ROWS = 1024
"""From so many training rows on, a float32 product picks a shortlist that is measured exactly."""
SHORTLIST = 24
"""How many more rows than voters a shortlist has, so that its check rarely fails."""
FLOAT32_FIT = (2.0**-16, 2.0**16)
"""Lengths of rows whose float32 squares and products need no scaling."""


class Builder:
    """Nodes and constants of a graph under construction, either the main one or a branch."""

    def __init__(self, scope: Any, container: Any) -> None:
        self._scope, self._container = scope, container
        self._constants: dict[tuple[str, tuple[int, ...], bytes], str] = {}
        self._branch: list[onnx.NodeProto] | None = None

    def constant(self, value: Any, dtype: Any = np.float64) -> str:
        """Name of a constant; equal ones are stored once."""
        array = np.asarray(value, dtype=dtype)
        key = (array.dtype.str, array.shape, array.tobytes())
        if key not in self._constants:
            name = self._scope.get_unique_variable_name("constant")
            tensor = numpy_helper.from_array(np.ascontiguousarray(array).reshape(array.shape))
            self._container.add_initializer(name, tensor.data_type, list(array.shape), tensor)
            self._constants[key] = name
        return self._constants[key]

    def node(self, operator: str, inputs: list[str], output: str = "", **attributes: Any) -> str:
        """Add an operator of one output and return its name."""
        return self.nodes(operator, inputs, [output], **attributes)[0]

    def nodes(
        self, operator: str, inputs: list[str], outputs: list[str], **attributes: Any
    ) -> list[str]:
        """Add an operator; an output named "" gets a name of its own."""
        names = [o or self._scope.get_unique_variable_name(operator.lower()) for o in outputs]
        label = self._scope.get_unique_operator_name(operator)
        if self._branch is not None:
            self._branch.append(helper.make_node(operator, inputs, names, name=label, **attributes))
        else:
            self._container.add_node(
                operator, inputs, names, op_version=OPSET, name=label, **attributes
            )
        return names

    def branch(self, name: str, outputs: dict[str, Any], make: Any) -> onnx.GraphProto:
        """The graph of what `make()` adds; it returns the outputs' names in order.

        Args:
            name: of the graph.
            outputs: {name: tensor type}, each (rows, columns).
            make: adds nodes to this builder.
        """
        self._branch = []
        made = make()
        infos = []
        for seen, (wanted, kind) in zip(made, outputs.items(), strict=True):
            unique = self._scope.get_unique_variable_name(wanted)
            self.node("Identity", [seen], unique)
            infos.append(helper.make_tensor_value_info(unique, kind, [None, None]))
        nodes, self._branch = self._branch, None
        return helper.make_graph(nodes, name, [], infos)


def project(build: Builder, x: str, projection: Projection) -> str:
    """Features (n, p) to coordinates (n, c); see `train.pipeline.Projection`."""
    d = build.node("Sub", [x, build.constant(projection.mean)])
    if not (projection.gain == 1.0).all():
        d = build.node("Mul", [d, build.constant(projection.gain)])
    halves = []
    for grid in (projection.high, projection.low):
        step = build.constant(grid)
        half = build.node("Sub", [build.node("Add", [d, step]), step])
        halves.append(half)
        if grid == projection.high:
            d = build.node("Sub", [d, half])
    weights = build.constant(projection.weights)
    high, low = (build.node("MatMul", [half, weights]) for half in halves)
    return build.node("Add", [high, low])


def _measured(build: Builder, z: str, rows: NDArray[np.float64], k: int) -> list[str]:
    """Squared distances and rows (n, k) of the nearest, every row measured directly."""
    columns = build.constant(rows.T)  # (c, rows): sums over c then run along memory
    point = build.node("Unsqueeze", [z, build.constant([2], np.int64)])
    gaps = build.node("Sub", [columns, point])
    squares = build.node("ReduceSumSquare", [gaps, build.constant([1], np.int64)], keepdims=0)
    return build.nodes(
        "TopK", [squares, build.constant([k], np.int64)], ["", ""], largest=0, sorted=1
    )


def _unit(rows: NDArray[np.float64]) -> float:
    """The power of two that brings the longest row near length 1; 1 where float32 needs none.

    A float32 square vanishes below 1e-23 and overflows above 1.8e19.
    """
    longest = float(np.sqrt((rows**2).sum(axis=1)).max(initial=0.0))
    if longest == 0.0 or FLOAT32_FIT[0] <= longest <= FLOAT32_FIT[1]:
        return 1.0
    return math.ldexp(1.0, 1 - math.frexp(longest)[1])


def _shortlisted(build: Builder, z: str, rows: NDArray[np.float64], k: int) -> list[str]:
    """As `_measured`, where a float32 product first picks the rows worth measuring.

    With b a training row and q the query, |b - q|^2 - |q|^2 = |b|^2 - 2 b.q is computed in
    float32 with an error of at most e = u (2 B^2 + |q|^2), where B is the longest row and
    u = (c + 8) 2^-23 covers the c products, their sum and the three conversions (Higham,
    Accuracy and Stability, section 3.1). Every row outside the shortlist is at least as far as
    its last entry says, less e; where the k-th measured distance is below that, no row outside
    can be among the k nearest. Where it is not (many near-duplicates), all rows are measured.
    That holds as long as float32 neither overflows nor loses squares, so rows of another size
    are scaled by a power of two first.
    """
    c = rows.shape[1]
    unit = _unit(rows)
    if unit != 1.0:
        rows = rows * unit
        z = build.node("Mul", [z, build.constant(unit)])
    lengths = (rows**2).sum(axis=1)
    u = (c + 8) * 2.0**-23
    slack = 2.0 * u * float(lengths.max())
    count = k + SHORTLIST

    def ints(*values: int) -> str:
        return build.constant(values, np.int64)

    single = build.node("Cast", [z], to=TensorProto.FLOAT)
    product = build.node("MatMul", [single, build.constant(-2.0 * rows.T, np.float32)])
    rough = build.node("Add", [product, build.constant(lengths, np.float32)])
    values, picked = build.nodes("TopK", [rough, ints(count)], ["", ""], largest=0, sorted=1)
    # In the order of the rows, so that equal distances go to the earlier one.
    ordered, _ = build.nodes("TopK", [picked, ints(count)], ["", ""], largest=0, sorted=1)
    near = build.node("Gather", [build.constant(rows), ordered], axis=0)
    gaps = build.node("Sub", [near, build.node("Unsqueeze", [z, ints(1)])])
    squares = build.node("ReduceSumSquare", [gaps, ints(2)], keepdims=0)
    short, places = build.nodes("TopK", [squares, ints(k)], ["", ""], largest=0, sorted=1)
    found = build.node("GatherElements", [ordered, places], axis=1)
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
    sure = build.node("Less", [build.node("Add", [kth, build.constant(slack)]), reach])
    flags = build.node("Cast", [sure], to=TensorProto.FLOAT)
    all_sure = build.node("ReduceMin", [flags, ints(0, 1)], keepdims=0)
    outputs = {"squares": TensorProto.DOUBLE, "rows": TensorProto.INT64}
    then = build.branch("shortlisted", outputs, lambda: [short, found])
    other = build.branch("measured", outputs, lambda: _measured(build, z, rows, k))
    near_squares, near_rows = build.nodes(
        "If",
        [build.node("Cast", [all_sure], to=TensorProto.BOOL)],
        ["", ""],
        then_branch=then,
        else_branch=other,
    )
    if unit != 1.0:
        near_squares = build.node("Mul", [near_squares, build.constant(unit**-2)])
    return [near_squares, near_rows]


def _first(build: Builder, values: str, have: int, want: int) -> str:
    """The first `want` of `have` columns."""
    if have == want:
        return values
    ints = [build.constant([i], np.int64) for i in (0, want, 1)]
    return build.node("Slice", [values, *ints])


def _decide(
    build: Builder, task: str, labels: NDArray[np.int64], classes: int, k: int, near: list[str]
) -> None:
    """Squared distances and rows of the neighbours to the four outputs of a task."""
    squares, rows = near
    build.node("Sqrt", [squares], f"{task}_distances")
    build.node("Identity", [rows], f"{task}_neighbours")
    said = build.node("Gather", [build.constant(labels, np.int64), rows])
    # A distance that is no number, or none that float64 holds, votes for nothing: class -1,
    # whose row of the votes (the last one) is empty.
    known = build.node("LessOrEqual", [squares, build.constant(LARGEST)])
    said = build.node("Where", [known, said, build.constant(-1, np.int64)])
    # A power of two divides without rounding, so its ballots may already be shares.
    share = 1.0 / k if k & (k - 1) == 0 else 1.0
    ballots = build.constant(np.vstack([share * np.eye(classes), np.zeros((1, classes))]))
    cast = build.node("Gather", [ballots, said])
    axis = build.constant([1], np.int64)
    if share == 1.0 and k > 1:
        votes = build.node("ReduceSum", [cast, axis], keepdims=0)
        build.node("Div", [votes, build.constant(float(k))], f"{task}_scores")
    else:
        votes = build.node("ReduceSum", [cast, axis], f"{task}_scores", keepdims=0)
    if k <= 2:
        # Two neighbours agree or tie: either way the nearest has it.
        build.node("Gather", [said, build.constant(0, np.int64)], f"{task}_label", axis=1)
        return
    # The first neighbour whose class has the most votes is the nearest of the tied.
    own = build.node("GatherElements", [votes, said], axis=1)
    place = build.node("ArgMax", [own], axis=1, keepdims=1)
    label = build.node("GatherElements", [said, place], axis=1)
    build.node("Squeeze", [label, axis], f"{task}_label")


def _convert(scope: Any, operator: Any, container: Any) -> None:
    model: ContactClassifier = operator.raw_operator
    build = Builder(scope, container)
    names = {output.raw_name: output.full_name for output in operator.outputs}
    x = operator.inputs[0].full_name
    groups: dict[tuple[str, int], int] = {}
    for task, choice in model.choices.items():
        key = (choice.scaling, model.components_[task])
        groups[key] = max(groups.get(key, 0), choice.k)
    points = {s: project(build, x, p) for s, p in model.projections_.items()}
    near: dict[tuple[str, int], list[str]] = {}
    for (scaling, components), k in groups.items():
        rows = model.rows_[scaling]
        z = _first(build, points[scaling], rows.shape[1], components)
        # A shortlist of most rows saves nothing.
        short = len(rows) >= SHORTLIST_ROWS and 2 * (k + SHORTLIST) <= len(rows)
        find = _shortlisted if short else _measured
        near[scaling, components] = find(build, z, rows[:, :components], k)
    for task, choice in model.choices.items():
        key = (choice.scaling, model.components_[task])
        found = [_first(build, name, groups[key], choice.k) for name in near[key]]
        _decide(
            build,
            names[f"{task}_label"].removesuffix("_label"),
            model.labels_[task],
            len(model.classes_[task]),
            choice.k,
            found,
        )


def _outputs(model: ContactClassifier) -> list[tuple[str, Any]]:
    found: list[tuple[str, Any]] = []
    for task, choice in model.choices.items():
        found += [
            (f"{task}_label", Int64TensorType([None])),
            (f"{task}_scores", DoubleTensorType([None, len(model.classes_[task])])),
            (f"{task}_distances", DoubleTensorType([None, choice.k])),
            (f"{task}_neighbours", Int64TensorType([None, choice.k])),
        ]
    return found


def _parse(
    scope: Any, model: ContactClassifier, inputs: list[Any], custom_parsers: Any = None
) -> list[Any]:
    operator = scope.declare_local_operator("ContactClassifier", model)
    operator.inputs.append(inputs[0])
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


def to_onnx(model: ContactClassifier, info: ModelInfo) -> bytes:
    """The fitted tasks and the metadata as a checked, self-contained ONNX file."""
    update_registered_converter(
        ContactClassifier, "ContactClassifier", _shapes, _convert, parser=_parse, overwrite=True
    )
    proto = convert_sklearn(
        model,
        name="edge-classify",
        initial_types=[("features", DoubleTensorType([None, info.width]))],
        target_opset={"": OPSET},
    )
    nodes = _in_order(list(proto.graph.node), {"features"})
    del proto.graph.node[:]
    proto.graph.node.extend(nodes)
    proto.ir_version = IR_VERSION
    proto.producer_name = "edge-classify"
    proto.doc_string = "scaler, PCA and k-NN of a touch; see the metadata"
    helper.set_model_props(proto, {METADATA_KEY: info.to_json()})
    onnx.checker.check_model(proto, full_check=True)
    data: bytes = proto.SerializeToString(deterministic=True)
    check(data, "the exported model")
    return data
