"""A model's graph as steps and tables for `export/c/graph.c`: what depends on constants
and the decision point alone is computed here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from math import prod
from typing import NamedTuple

import numpy as np
import onnx
import onnxruntime
from onnx.helper import make_empty_tensor_value_info

from edge.arrays import Array, Floats, Integers
from edge.decide.model import Model
from edge.errors import InputError
from export.build import smallest

NOWHERE = 65535
"""No place."""
PACKED_BITS = 25
"""The most bits of a number of a packed matrix."""
MOST_SHIFT = 40
READ_AHEAD = 3
"""Bytes that are read behind a packed number."""
MATRICES = (("Project", 3), ("MatMul", 1), ("Gemm", 1))
"""Operators and which of their inputs is a matrix."""
COLUMNS = ("Project", 4)
"""The input that tells which features are projected."""
CHAIN = "Clip Round Mul Sub".split()
"""How features become steps of a projection, backwards."""
ELEMENT_WISE = "Add Sub Mul Div Max LessOrEqual Where Clip Round Sqrt Squeeze".split()
TYPES = "int8 int16 int32 float32 float64".split()
"""Of tables, from the smallest."""

NO_PALETTE = np.zeros(0)


class Table(NamedTuple):
    """Numbers; see `ec_table` in `export/c/internal.h`.

    Attributes:
        type: its name in C.
        data: (n,), or (points, n) where the decision points' differ.
        palette: the numbers that the data counts; or none.
        columns: of a packed matrix.
        shift: likewise.
    """

    type: str
    data: Array
    palette: Floats = NO_PALETTE
    columns: int = 0
    shift: int = 0

    @property
    def nbytes(self) -> int:
        """Of its numbers."""
        return self.data.nbytes + self.palette.nbytes


class Step(NamedTuple):
    """A node; see `ec_step` in `export/c/internal.h`.

    Attributes:
        operator: its name in C.
        inputs, outputs: places in the arena, or behind it numbers of tables.
        sizes: as the operator's function in `export/c/graph.c` takes them.
    """

    operator: str
    inputs: Sequence[int]
    outputs: Sequence[int]
    sizes: Sequence[int]


class Node(NamedTuple):
    """A node of the graph."""

    operator: str
    inputs: list[str]
    outputs: list[str]
    attributes: dict[str, int]

    @classmethod
    def of(cls, node: onnx.NodeProto) -> Node:
        """A node of a file."""
        attributes = {a.name: a.i for a in node.attribute}
        return cls(node.op_type, list(node.input), list(node.output), attributes)


class CompiledGraph:
    """The steps, the tables and the arena of a model's outputs.

    Attributes:
        arena: how many doubles the steps work in; the features come first.
        tables: of constants.
        steps: in the order of computation.
        places: {output: its place in the arena}.
    """

    def __init__(
        self, model: Model, outputs: Set[str], points: Sequence[int], arena: int
    ) -> None:
        """Compile.

        Args:
            model: whose graph it is.
            outputs: that are kept.
            points: the decision points that are kept.
            arena: the least size of the arena.

        Raises:
            InputError: C lacks something that the graph needs.
        """
        self._width = model.info.width
        self.arena = max(arena, self._width)
        self.tables: list[Table] = []
        self.places = {"features": 0, "": NOWHERE}
        self._numbers: dict[tuple[str, tuple[int, ...], bytes], int] = {}
        self._of_means: dict[str, Array] = {}
        """{name of means: which features they are of}."""
        proto = onnx.load_from_string(model.contents.data)
        nodes = list(map(Node.of, proto.graph.node))
        self._makers = {name: node for node in nodes for name in node.outputs}
        del proto.graph.output[:]
        proto.graph.output.extend(map(make_empty_tensor_value_info, self._makers))
        options = onnxruntime.SessionOptions()
        options.log_severity_level = 4
        session = onnxruntime.InferenceSession(proto.SerializeToString(), options)
        self._values: list[dict[str, Array]] = []
        for point in points:
            inputs = {"features": np.zeros((1, self._width))}
            if model.info.decision_points_s:
                inputs["decision_point"] = np.array([point])
            values = session.run(None, inputs)
            results = dict(zip(self._makers, values, strict=True))
            self._values.append(model.contents.constants | inputs | results)
        self._variable = {"features"}
        for node in nodes:
            if not self._variable.isdisjoint(node.inputs):
                self._variable.update(node.outputs)
        nodes = self._needed(nodes, outputs)
        nodes = self._needed([*self._fused(nodes), *nodes], outputs)
        self._place(nodes, outputs)
        self.steps = list(map(self._step, nodes))
        if self.arena + len(self.tables) >= NOWHERE:
            raise InputError("C cannot take so many numbers; export fewer features")

    def _needed(self, nodes: Iterable[Node], outputs: Set[str]) -> list[Node]:
        """The nodes that make some outputs; of two that make a value the first."""
        unique = {}
        for node in nodes:
            unique.update({name: node for name in node.outputs if name not in unique})
        needed = set(outputs)
        chosen: list[Node] = []
        for node in reversed(list(nodes)):
            makes = {name for name in node.outputs if unique.get(name) is node}
            if not needed.isdisjoint(self._variable & makes):
                needed.update(self._inputs(node))
                chosen.insert(0, node)
        return chosen

    def _fused(self, nodes: Iterable[Node]) -> Iterable[Node]:
        """The same as some nodes, of features alone: `Project`, which takes features to
        a product in one pass, and `Finite`, which asks whether all are finite."""
        users: dict[str, list[Node]] = {}
        for node in nodes:
            for name in node.inputs:
                users.setdefault(name, []).append(node)
        taken: set[str] = set()
        for node in nodes:
            chain = self._chain(node)
            if node.operator == "ReduceL1" and self._is_guard(node.inputs[0]):
                yield Node("Finite", ["features"], node.outputs, {})
            elif chain:
                clip, rounded, gained, centred = chain
                (steps,) = clip.outputs
                sides = ["", ""]
                for user in users[steps] if steps not in taken else ():
                    if user.operator == "ReduceSumSquare":
                        sides[1] = user.outputs[0]
                    elif user.operator == "Sub" and user.inputs[0] in rounded.outputs:
                        sides[0] = users[user.outputs[0]][0].outputs[0]
                taken.add(steps)
                columns = self._columns(centred.inputs[0]) or ""
                means = self._means(centred.inputs[1], columns)
                names = [means, gained.inputs[1], clip.inputs[2], node.inputs[1]]
                names.append(columns)
                yield Node("Project", names, [*node.outputs, *sides], {})

    def _chain(self, node: Node) -> list[Node]:
        """The nodes that take features to the first factor of a product whose other one
        can be packed, from the last; or none."""
        if node.operator != "MatMul" or node.inputs[1] in self._variable:
            return []
        chain = []
        name = node.inputs[0]
        for operator in CHAIN:
            maker = self._maker(name, operator)
            if maker is None or not self._variable.isdisjoint(maker.inputs[1:]):
                return []
            chain.append(maker)
            name = maker.inputs[0]
        is_packed = packed(self._constants(node.inputs[1])) is not None
        return chain if is_packed and self._columns(name) is not None else []

    def _maker(self, name: str, operator: str) -> Node | None:
        """What makes a value, if it is of an operator."""
        maker = self._makers.get(name)
        return maker if maker is not None and maker.operator == operator else None

    def _is_guard(self, name: str) -> bool:
        """Whether a value is of all features times 0."""
        maker = self._maker(name, "Mul")
        if maker is None or maker.inputs[0] != "features":
            return False
        return not self._constants(maker.inputs[1]).any()

    def _columns(self, name: str) -> str | None:
        """The name of the places of gathered features, empty of all; or None."""
        if name == "features":
            return ""
        maker = self._maker(name, "Gather")
        if maker is None or maker.inputs[0] != "features":
            return None
        return maker.inputs[1]

    def _means(self, name: str, columns: str) -> str:
        """The name of means by feature, among them those of some columns. Tasks share
        them where they agree."""
        count = len(self._values)
        wide = np.zeros((count, self._width))
        at = self._constants(columns)[0].astype(int) if columns else slice(None)
        wide[:, at] = self._constants(name).reshape(count, -1)
        mine = np.zeros(self._width, bool)
        mine[at] = True
        for shared, theirs in self._of_means.items():
            means = self._constants(shared)
            if (means == wide)[:, mine & theirs].all():
                wide = np.where(theirs, means, wide)
                mine |= theirs
                break
        else:
            shared = f"means {len(self._of_means)}"
        self._of_means[shared] = mine
        for values, means in zip(self._values, wide, strict=True):
            values[shared] = means
        return shared

    def _constants(self, name: str) -> Floats:
        """(points, ...) of a value that depends on the decision point alone."""
        return np.stack([at[name] for at in self._values]).astype(float)

    def _shape(self, name: str) -> tuple[int, ...]:
        return self._values[0][name].shape

    def _place(self, nodes: Sequence[Node], outputs: Iterable[str]) -> None:
        """Give each value a place in the arena, from its first use to its last. What is
        computed number by number may take the place of what it is computed from.
        """
        last = {}
        for i, node in enumerate(nodes):
            last.update(dict.fromkeys([*node.inputs, *node.outputs], i))
            if node.operator == "Project":
                last["features"] = i
        last.update(dict.fromkeys(outputs, len(nodes)))
        spans = {"features": (0, self._width)}
        for i, node in enumerate(nodes):
            shape = self._shape(node.outputs[0])
            in_place = node.operator in ELEMENT_WISE
            spans = {
                name: span
                for name, span in spans.items()
                if last[name] >= i + (in_place and self._shape(name) == shape)
            }
            for name in filter(None, node.outputs):
                size = prod(self._shape(name))
                begin = 0
                for low, high in sorted(spans.values()):
                    if low < begin + size:
                        begin = max(begin, high)
                spans[name] = begin, begin + size
                self.places[name] = begin
                self.arena = max(self.arena, begin + size)

    def _step(self, node: Node) -> Step:
        """The step of a node."""
        names = self._inputs(node)
        operator = node.operator
        if operator == "Where" and len(names) == 1:
            operator = "Squeeze"
        inputs = [self._operand(name, (operator, i)) for i, name in enumerate(names)]
        outputs = [self.places[name] for name in node.outputs]
        sizes = self._sizes(node, operator)
        return Step(f"EC_{operator.upper()}", inputs, outputs, sizes)

    def _inputs(self, node: Node) -> list[str]:
        """The inputs; one alone of a `Where` that chooses the same at all points."""
        if node.operator == "Where" and node.inputs[0] not in self._variable:
            conditions = np.array([at[node.inputs[0]] for at in self._values])
            if conditions.all():
                return node.inputs[1:2]
            if not conditions.any():
                return node.inputs[2:]
        return node.inputs

    def _sizes(self, node: Node, operator: str) -> list[int]:
        """The sizes of a step."""
        size = prod(self._shape(node.outputs[0]))
        if operator in ELEMENT_WISE:
            counts = [prod(self._shape(name)) for name in self._inputs(node)]
            is_long = operator == "Max" and len(counts) > 2
            if is_long or not {1, size}.issuperset(counts):
                raise InputError(f"C cannot combine {counts} numbers; export it again")
            return [size, *counts]
        if operator == "Finite":
            return [1, self._width, 1, 1]
        shape = self._shape(node.inputs[0])
        if operator == "Project":
            shape = 1, self._shape(node.inputs[3])[0]
        axis = len(shape) - 1
        if node.operator == "Gather":
            axis = node.attributes.get("axis", 0)
        elif operator.startswith("Reduce"):
            (axis,) = self._values[0][node.inputs[1]].tolist()
        before = prod(shape[:axis])
        behind = prod(shape[axis + 1 :])
        return [before, shape[axis], behind, size // (before * behind)]

    def _operand(self, name: str, use: tuple[str, int]) -> int:
        """The place of a value, or the number of its table, for an input of an
        operator."""
        if name in self._variable or not name:
            return self.places[name]
        values = self._constants(name)
        if use == COLUMNS:
            return self._number(
                Table("int16", values[0].astype(np.uint16).astype("i2"))
            )
        table = packed(values) if use in MATRICES else None
        if table is None:
            values = values.reshape(len(values), -1)
            table = as_table(values[0] if (values == values[0]).all() else values)
        return self._number(table)

    def _number(self, table: Table) -> int:
        """The number of a table, behind the arena; equal ones are stored once."""
        key = (
            table.type,
            table.data.shape,
            table.data.tobytes() + table.palette.tobytes(),
        )
        if key not in self._numbers:
            self._numbers[key] = len(self.tables)
            self.tables.append(table)
        return self.arena + self._numbers[key]


def as_table(values: Floats) -> Table:
    """Numbers, of the smallest type; or in a palette if there are few that differ."""
    small = smallest(values, TYPES)
    palette, places = np.unique(values, return_inverse=True)
    is_few = palette.size <= 256 and values.size + palette.nbytes < small.nbytes
    if is_few:
        data = places.reshape(values.shape).astype(np.uint8)
        return Table("palette", data, palette)
    return Table(small.dtype.name, small)


def packed(matrices: Floats) -> Table | None:
    """Matrices (points, n, m) whose numbers are whole times a power of two, row by row,
    each with as few bits as its row needs; None if they are not. Columns of zeros at the
    end are left out.
    """
    if (matrices == matrices[0]).all():
        matrices = matrices[:1]
    shift = 0
    while shift < MOST_SHIFT and (matrices != np.rint(matrices)).any():
        matrices = 2.0 * matrices
        shift += 1
    fits = np.abs(matrices) < 2 ** (PACKED_BITS - 1)
    if not (fits & (matrices == np.rint(matrices))).all():
        return None
    columns = int(np.flatnonzero(matrices.any((0, 1))).max(initial=-1)) + 1
    whole = np.rint(matrices[:, :, :columns]).astype(np.int64)
    rows = [b"".join(map(packed_row, matrix)) for matrix in whole]
    size = max(map(len, rows)) + READ_AHEAD
    data = np.array([[*row.ljust(size, b"\0")] for row in rows], np.uint8)
    return Table(
        "packed", data[0] if len(rows) == 1 else data, columns=columns, shift=shift
    )


def packed_row(row: Integers) -> bytes:
    """The bits of a number, and then those of each number, which is moved above 0."""
    bits = int(np.maximum(row, ~row).max(initial=0)).bit_length() + bool(row.any())
    moved = row + (1 << bits >> 1)
    ones = moved[:, None] >> np.arange(bits) & 1
    return bytes([bits]) + np.packbits(ones.astype(bool), bitorder="little").tobytes()
