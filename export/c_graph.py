"""A model's graph as steps and tables for `export/c/graph.c`: what depends on constants
and the decision point alone is computed here."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from edge.arrays import Array, Floats
from edge.errors import InputError
from edge.model.graph import OPERATORS, Graph
from edge.model.model import Model
from edge.model.onnx_file import Node

ELEMENT_WISE = "Add Sub Mul Div Max LessOrEqual Where Clip Round Sqrt".split()
REDUCTIONS = "ReduceL1 ReduceSum ReduceSumSquare ReduceMean".split()
NAMES = {"MatMul": "Gemm", "GatherElements": "Gather", "GatherND": "Gather"}
KNOWN = {*ELEMENT_WISE, *REDUCTIONS, *"Gemm TopK Gather Pad ArgMax".split()}
MOST_POINTS = 16
"""Decision points that a step's mask has bits for."""
TYPES = {
    "EC_INT8": np.int8,
    "EC_INT16": np.int16,
    "EC_INT32": np.int32,
    "EC_FLOAT": np.float32,
    "EC_DOUBLE": np.float64,
}
"""{type in C: that of numpy}, from the smallest."""


@dataclass(frozen=True)
class Table:
    """Numbers in the smallest type that holds them exactly.

    Attributes:
        kind: of `TYPES`.
        values: (n,), or (points, n) where the decision points' numbers differ.
    """

    kind: str
    values: Array


@dataclass(frozen=True)
class Step:
    """A node; see `ec_step` in `export/c/internal.h`.

    Attributes:
        operator: of ONNX.
        points: mask of the decision points that need it.
        inputs, outputs: places in the arena, or behind it numbers of tables.
        sizes: as the operator's function in `export/c/graph.c` takes them.
    """

    operator: str
    points: int
    inputs: Sequence[int]
    outputs: Sequence[int]
    sizes: Sequence[int]


class CompiledGraph:
    """The steps, the tables and the arena of a model's outputs.

    Attributes:
        arena: how many doubles the steps work in; the features come first.
        tables: of constants.
        steps: in the order of computation.
        places: {output: its place in the arena}.
    """

    def __init__(
        self,
        model: Model,
        outputs: Sequence[str],
        points: Sequence[int],
        arena: int,
    ) -> None:
        """Compile.

        Args:
            model: whose graph it is.
            outputs: that are computed.
            points: the decision points that are kept.
            arena: the least size of the arena.

        Raises:
            InputError: there are too many decision points.
        """
        if len(points) > MOST_POINTS:
            raise InputError(f"C takes at most {MOST_POINTS} decision points")
        self.arena = max(arena, model.info.width)
        self.tables: list[Table] = []
        self._numbers: dict[bytes, int] = {}
        self._read(model, points)
        self._needs = [self._needed(outputs, i) for i in range(len(points))]
        nodes = self._in_order(outputs)
        self._place(nodes, outputs)
        self.steps = [step for node in nodes for step in self._steps(node)]

    def _read(self, model: Model, points: Sequence[int]) -> None:
        """The values that constants make at each decision point, and all shapes."""
        graph = Graph(model.contents)
        constants = {n: v for n, v in graph.constants.items() if n != "decision_point"}
        nodes = model.contents.nodes
        self._makers = graph.makers
        self._constants = [_folded(nodes, constants, point) for point in points]
        names = [name for name in graph.makers if name not in self._constants[0]]
        x = np.zeros((1, model.info.width))
        values = graph.run(names, {"features": x})
        made = {"features": x} | dict(zip(names, values, strict=True))
        self._made = set(made)
        known = made | self._constants[0]
        self._shapes = {name: value.shape for name, value in known.items()}

    def _inputs(self, node: Node, point: int) -> Sequence[str]:
        """The inputs that a node needs at a decision point."""
        if node.operator == "Where":
            condition, chosen, other = node.inputs
            known = self._constants[point].get(condition)
            if known is not None and known.size == 1:
                return [chosen if known.item() else other]
        return node.inputs

    def _needed(self, outputs: Sequence[str], point: int) -> set[str]:
        """The values that outputs need at a decision point."""
        needed: set[str] = set()
        waiting = list(outputs)
        while waiting:
            name = waiting.pop()
            if name not in needed and name in self._made - {"features"}:
                needed.add(name)
                waiting += self._inputs(self._makers[name], point)
        return needed

    def _in_order(self, outputs: Sequence[str]) -> list[Node]:
        """The nodes, one output after another, so that few values are kept at once."""
        needed = set.union(*self._needs)
        nodes: dict[int, Node] = {}
        waiting = [*outputs[::-1]]
        while waiting:
            node = self._makers[waiting[-1]]
            inputs = [name for name in node.inputs if name in needed]
            ahead = [name for name in inputs if id(self._makers[name]) not in nodes]
            if ahead and id(node) not in nodes:
                waiting += ahead[::-1]
            else:
                nodes.setdefault(id(node), node)
                waiting.pop()
        return list(nodes.values())

    def _place(self, nodes: Sequence[Node], outputs: Sequence[str]) -> None:
        """Give each value a place in the arena, from its first use to its last."""
        self.places = {"features": 0}
        roots = {"features": "features"}
        last = dict.fromkeys(outputs, len(nodes))
        for i, node in enumerate(nodes):
            for name in node.outputs:
                squeezed = node.operator == "Squeeze"
                roots[name] = roots[node.inputs[0]] if squeezed else name
            for name in (*node.inputs, *node.outputs):
                root = roots.get(name, name)
                last[root] = max(last.get(root, 0), last.get(name, 0), i)
        taken = {"features": (0, self._shapes["features"][1])}
        for i, node in enumerate(nodes):
            for name in node.outputs:
                if roots[name] == name:
                    begin = _gap(taken.values(), prod(self._shapes[name]))
                    taken[name] = begin, begin + prod(self._shapes[name])
                    self.arena = max(self.arena, taken[name][1])
                    self.places[name] = begin
                self.places[name] = self.places[roots[name]]
            taken = {name: span for name, span in taken.items() if last[name] > i}

    def _steps(self, node: Node) -> Iterator[Step]:
        """The steps of a node: none of a `Squeeze`, several of a `Max`."""
        operator = NAMES.get(node.operator, node.operator)
        if operator == "Squeeze":
            return
        if operator not in KNOWN:
            raise InputError(f"C has no operator {operator}")
        points = sum(
            1 << i
            for i, needed in enumerate(self._needs)
            if not needed.isdisjoint(node.outputs)
        )
        inputs = list(map(self._operand, self._runtime_inputs(node)))
        outputs = [self.places[name] for name in node.outputs]
        sizes = self._sizes(node, operator)
        if operator != "Max":
            yield Step(operator, points, inputs, outputs, sizes)
            return
        for place in inputs[1:]:
            yield Step(operator, points, [inputs[0], place], outputs, sizes[:3])
            inputs[0] = outputs[0]

    def _runtime_inputs(self, node: Node) -> list[str]:
        """The inputs without those that say which axes."""
        if node.operator in ("TopK", *REDUCTIONS):
            return node.inputs[:1]
        return node.inputs[::2] if node.operator == "Pad" else node.inputs

    def _sizes(self, node: Node, operator: str) -> list[int]:
        """The sizes of a step."""
        shape = self._shapes[node.inputs[0]]
        out = self._shapes[node.outputs[0]]
        if operator in ELEMENT_WISE:
            return [prod(out), *(self._broadcast(name, out) for name in node.inputs)]
        if operator == "Gemm":
            return [*self._shapes[node.inputs[1]], len(node.inputs) - 2]
        if operator == "TopK":
            return [prod(shape[:-1]), shape[-1], out[-1]]
        if operator in ("Pad", "ArgMax"):
            return [prod(shape)]
        if operator == "Gather":
            axis = node.attributes.get("axis", 0)
            axis = axis if node.operator == "Gather" else len(shape) - 1
            count = prod(self._shapes[node.inputs[1]])
        else:
            (axis,) = self._constants[0][node.inputs[1]].tolist()
            count = 0
        return [prod(shape[:axis]), shape[axis], prod(shape[axis + 1 :]), count]

    def _broadcast(self, name: str, out: Sequence[int]) -> int:
        """How many numbers an element-wise step takes of an input: one, or all."""
        size = prod(self._shapes[name])
        if size not in (1, prod(out)):
            raise InputError(f"C cannot combine {self._shapes[name]} and {out} numbers")
        return size

    def _operand(self, name: str) -> int:
        """The place of a value, or the number of its table."""
        if name in self._made:
            return self.places.get(name, 0)  # of what no point needs, any
        values = np.stack([at[name].reshape(-1) for at in self._constants]).astype(
            float
        )
        if (values == values[0]).all():
            values = values[0]
        key = values.tobytes()
        if key not in self._numbers:
            self._numbers[key] = len(self.tables)
            self.tables.append(table_of(values))
        return self.arena + self._numbers[key]


def table_of(values: Floats) -> Table:
    """Numbers in the smallest type that holds them."""
    for kind, numbers in TYPES.items():
        with np.errstate(all="ignore"):
            small = values.astype(numbers)
        if np.array_equal(small.astype(np.float64), values):
            return Table(kind, small)
    raise InputError("a constant of the graph is not a number")


def _folded(
    nodes: Sequence[Node], constants: dict[str, Array], point: int
) -> dict[str, Array]:
    """The values that follow from constants at a decision point."""
    values = {**constants, "decision_point": np.array([point])}
    for node in nodes:
        if all(name in values for name in node.inputs):
            inputs = [values[name] for name in node.inputs]
            made = OPERATORS[node.operator](*inputs, attributes=node.attributes)
            made = made if len(node.outputs) > 1 else (made,)
            values.update(zip(node.outputs, made, strict=True))
    return values


def _gap(taken: Iterable[tuple[int, int]], size: int) -> int:
    """The first place with room for some numbers."""
    place = 0
    for begin, end in sorted(taken):
        if begin - place >= size:
            break
        place = max(place, end)
    return place
