"""A model's graph as steps and tables for `export/c/graph.c`: what depends on constants
and the decision point alone is computed here."""

from __future__ import annotations

from collections.abc import Iterable, Sequence, Set
from math import prod
from typing import NamedTuple

import numpy as np

from edge.arrays import Array
from edge.errors import InputError
from edge.model.graph import Graph
from edge.model.model import Model
from edge.model.onnx_file import Node
from export.build import smallest

ELEMENT_WISE = "Add Sub Mul Div Max LessOrEqual Where Clip Round Sqrt Squeeze".split()
TYPES = "int8 int16 int32 float32 float64".split()
"""Of tables, from the smallest."""


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


class CompiledGraph:
    """The steps, the tables and the arena of a model's outputs.

    Attributes:
        arena: how many doubles the steps work in; the features come first.
        tables: of constants, (n,), or (points, n) where the decision points' differ.
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
        self.arena = max(arena, model.info.width)
        self.tables: list[Array] = []
        self.places = {"features": 0}
        self._numbers: dict[tuple[tuple[int, ...], bytes], int] = {}
        graph = Graph(model.contents)
        self._values = []
        for point in points:
            inputs = {
                "features": np.zeros((1, model.info.width)),
                "decision_point": np.array([point]),
            }
            values = graph.run(list(graph.makers), inputs)
            results = dict(zip(graph.makers, values, strict=True))
            self._values.append(graph.constants | inputs | results)
        self._variable = {"features"}
        for node in model.contents.nodes:
            if not self._variable.isdisjoint(node.inputs):
                self._variable.update(node.outputs)
        needed = set(outputs)
        nodes: list[Node] = []
        for node in reversed(model.contents.nodes):
            if not needed.isdisjoint(self._variable.intersection(node.outputs)):
                needed.update(self._inputs(node))
                nodes.insert(0, node)
        self._place(nodes, outputs)
        self.steps = list(map(self._step, nodes))

    def _shape(self, name: str) -> tuple[int, ...]:
        return self._values[0][name].shape

    def _place(self, nodes: Sequence[Node], outputs: Iterable[str]) -> None:
        """Give each value a place in the arena, from its first use to its last. What is
        computed number by number may take the place of what it is computed from.
        """
        last = {}
        for i, node in enumerate(nodes):
            last.update(dict.fromkeys([*node.inputs, *node.outputs], i))
        last.update(dict.fromkeys(outputs, len(nodes)))
        spans = {"features": (0, self._shape("features")[1])}
        for i, node in enumerate(nodes):
            shape = self._shape(node.outputs[0])
            size = prod(shape)
            in_place = node.operator in ELEMENT_WISE
            spans = {
                name: span
                for name, span in spans.items()
                if last[name] >= i + (in_place and self._shape(name) == shape)
            }
            for name in node.outputs:
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
        inputs = list(map(self._operand, names))
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
        shape = self._shape(node.inputs[0])
        axis = len(shape) - 1
        if node.operator == "Gather":
            axis = node.attributes.get("axis", 0)
        elif operator.startswith("Reduce"):
            (axis,) = self._values[0][node.inputs[1]].tolist()
        before = prod(shape[:axis])
        behind = prod(shape[axis + 1 :])
        return [before, shape[axis], behind, size // (before * behind)]

    def _operand(self, name: str) -> int:
        """The place of a value, or the number of its table."""
        if name in self._variable:
            return self.places[name]
        values = np.stack([at[name].reshape(-1) for at in self._values]).astype(float)
        if (values == values[0]).all():
            values = values[0]
        key = values.shape, values.tobytes()
        if key not in self._numbers:
            self._numbers[key] = len(self.tables)
            self.tables.append(smallest(values, TYPES))
        return self.arena + self._numbers[key]
