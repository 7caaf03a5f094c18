"""Nodes and constants of an ONNX graph, and the projection that all its parts share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from train.projection import Grid

OPSET = 18


class Builder:
    """Nodes and constants of a graph under construction, either the main one or a branch.

    Attributes:
        decision_point: name of the scalar that says which decision point is asked for; unused
            without decision points.
    """

    def __init__(self, scope: Any, container: Any, decision_point: str = "") -> None:
        self._scope, self._container = scope, container
        self.decision_point = decision_point
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

    def ints(self, *values: int) -> str:
        """Name of a constant (n,) of axes, places or counts."""
        return self.constant(values, np.int64)

    def by_decision_point(self, values: Sequence[Any], dtype: Any = np.float64) -> str:
        """Name of the stacked constants' value at the decision point that is asked for."""
        if len(values) == 1:
            return self.constant(values[0], dtype)
        stack = self.constant(np.stack(values), dtype)
        return self.node("Gather", [stack, self.decision_point], axis=0)

    def by_decision_point_small(self, values: Sequence[Any]) -> str:
        """As `by_decision_point`, of numbers that float32 holds exactly: half the memory."""
        small = [np.asarray(value).astype(np.float32) for value in values]
        assert all((a == b).all() for a, b in zip(small, values, strict=True))
        return self.node("Cast", [self.by_decision_point(small, np.float32)], to=TensorProto.DOUBLE)

    def taken(self, x: str, columns: NDArray[np.int64], width: int) -> str:
        """Name of some columns of x (n, width); of x itself where they are all."""
        if len(columns) == width:
            return x
        return self.node("Gather", [x, self.constant(columns, np.int64)], axis=1)

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

    def branch(self, name: str, outputs: dict[str, tuple[Any, int]], make: Any) -> onnx.GraphProto:
        """The graph of what `make()` adds; it returns the outputs' names in order.

        Args:
            name: of the graph.
            outputs: {name: (tensor type, number of axes)}.
            make: adds nodes to this builder.
        """
        self._branch = []
        made = make()
        inside = {output for node in self._branch for output in node.output}
        infos = []
        for seen, (wanted, (kind, axes)) in zip(made, outputs.items(), strict=True):
            if seen not in inside:
                seen = self.node("Identity", [seen], self._scope.get_unique_variable_name(wanted))
            infos.append(helper.make_tensor_value_info(seen, kind, [None] * axes))
        nodes, self._branch = self._branch, None
        return helper.make_graph(nodes, name, [], infos)


class Affine(Protocol):
    """What `project` reads of a `train.projection.Projection`, or of several stacked."""

    mean_: NDArray[np.float64]
    gain_: NDArray[np.float64]
    grid_: Grid
    weights_: NDArray[np.float64]


def project(build: Builder, x: str, decision_points: Sequence[Affine]) -> str:
    """Features (n, p) to coordinates (n, c); see `train.projection.Projection`."""
    d = build.node("Sub", [x, build.by_decision_point([p.mean_ for p in decision_points])])
    if not all((p.gain_ == 1.0).all() for p in decision_points):
        d = build.node("Mul", [d, build.by_decision_point([p.gain_ for p in decision_points])])
    grids = [
        build.by_decision_point([p.grid_.high for p in decision_points]),
        build.by_decision_point([p.grid_.low for p in decision_points]),
    ]
    halves = []
    for step in grids:
        half = build.node("Sub", [build.node("Add", [d, step]), step])
        halves.append(half)
        if step == grids[0]:
            d = build.node("Sub", [d, half])
    weights = widened([p.weights_ for p in decision_points])
    # Components are multiples of 2^-WEIGHT_BITS, which float32 holds.
    weighing = (
        build.by_decision_point(weights)
        if len(weights) == 1
        else build.by_decision_point_small(weights)
    )
    high, low = (build.node("MatMul", [half, weighing]) for half in halves)
    return build.node("Add", [high, low])


def widened(arrays: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Arrays with columns of zeros added up to the widest: coordinates that are always 0."""
    most = max(array.shape[-1] for array in arrays)
    return [
        np.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, most - array.shape[-1])])
        for array in arrays
    ]
