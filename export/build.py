"""Nodes and constants of an ONNX graph, and the projection that all its parts share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from train.projection import FINE, RoundingGrid

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
        self._made: dict[tuple[Any, ...], str] = {}
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
        """As `by_decision_point`; in half the memory where float32 holds the numbers exactly."""
        with np.errstate(over="ignore"):
            small = [np.asarray(value).astype(np.float32) for value in values]
        if len(values) == 1 or not np.array_equal(small, values):
            return self.by_decision_point(values)
        return self.node("Cast", [self.by_decision_point(small, np.float32)], to=TensorProto.DOUBLE)

    def taken(self, x: str, columns: NDArray[np.int64], width: int) -> str:
        """Name of some columns of x (n, width); of x itself where they are all."""
        if len(columns) == width:
            return x
        return self.node("Gather", [x, self.constant(columns, np.int64)], axis=1)

    def node(self, operator: str, inputs: list[str], output: str = "", **attributes: Any) -> str:
        """Add an operator of one output and return its name; of equal ones, one is enough."""
        key = (operator, *inputs, *sorted(attributes.items()))
        made = self._made if self._branch is None else {}
        if output or key not in made:
            made[key] = self.nodes(operator, inputs, [output], **attributes)[0]
        return made[key]

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
    grid_: RoundingGrid
    weights_: NDArray[np.float64]


def project(
    build: Builder, x: str, decision_points: Sequence[Affine], reach: str = ""
) -> tuple[str, str]:
    """Features (n, p) to coordinates (n, c); see `train.projection.Projection`.

    Gains and weights carry the grid's unit, a power of two: no bit of a coordinate changes.

    Args:
        build: takes the nodes.
        x: name of the features.
        decision_points: a projection for each.
        reach: name to give to the second result.

    Returns:
        The coordinates, and (n,) the length of the scaled differences in units of the grid.
    """
    d = build.node("Sub", [x, build.by_decision_point([p.mean_ for p in decision_points])])
    for factors in _gains(decision_points):
        d = build.node("Mul", [d, build.by_decision_point(factors)])
    length = build.node("ReduceL2", [d, build.ints(1)], reach, keepdims=0)
    high = build.node("Round", [d])
    fine = build.constant(FINE)
    low = build.node("Sub", [build.node("Add", [build.node("Sub", [d, high]), fine]), fine])
    weights = build.by_decision_point_small(
        widened([p.weights_ * p.grid_.unit for p in decision_points])
    )
    halves = [build.node("MatMul", [half, weights]) for half in (high, low)]
    return build.node("Add", halves), length


def _gains(decision_points: Sequence[Affine]) -> list[list[Any]]:
    """Gains over the grids' units; one after the other where float64 holds no quotient."""
    units = [p.grid_.unit for p in decision_points]
    with np.errstate(over="ignore"):
        gains = [p.gain_ / unit for p, unit in zip(decision_points, units, strict=True)]
    if np.isfinite(gains).all():
        return [gains]
    return [[p.gain_ for p in decision_points], [1.0 / unit for unit in units]]


def widened(arrays: Sequence[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Arrays with columns of zeros added up to the widest: coordinates that are always 0."""
    most = max(array.shape[-1] for array in arrays)
    return [
        np.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, most - array.shape[-1])])
        for array in arrays
    ]
