"""Nodes and constants of an ONNX graph, and a projection of features as its nodes."""

from __future__ import annotations

import copy
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from onnx import NodeProto, TensorProto, helper, numpy_helper

from edge.arrays import Array, Floats, Integers
from edge.errors import InputError
from train.model.pipeline import FittedSpace
from train.model.projection import MOST_STEPS, Projection

STORED = ("int16", "float32", "float64")
"""Types of constants in a model file."""


def smallest(values: Floats, kinds: Iterable[str]) -> Array:
    """Numbers in the first type that holds them exactly.

    Raises:
        InputError: none does.
    """
    for kind in kinds:
        with np.errstate(all="ignore"):
            small = values.astype(kind)
        if np.array_equal(small.astype(np.float64), values):
            return small
    raise InputError("a constant of the graph is not a number")


class Builder:
    """Nodes and constants of a graph under construction.

    Attributes:
        decision_point: name of the scalar that says which decision point is asked for;
            unused without decision points.
        made: nodes, in the order of computation.
        constants: by their names.
    """

    def __init__(self) -> None:
        self.decision_point = ""
        self.made: list[NodeProto] = []
        self.constants: dict[str, TensorProto] = {}
        self._results: dict[tuple[Any, ...], str] = {}
        self._numbers: dict[tuple[Any, ...], int] = {}

    def among(self, decision_points: Sequence[int], count: int) -> Builder:
        """A builder of the same graph, whose constants stand for some of `count`
        decision points, which are successive.

        At the others it takes the constants of the nearest of these.
        """
        if len(decision_points) == count:
            return self
        first = decision_points[0]
        places = np.clip(np.arange(count), first, decision_points[-1]) - first
        part = copy.copy(self)
        name = f"places from {first} to {decision_points[-1]}"
        part.decision_point = self.node(
            "Gather", self.constant(places, name), self.decision_point, axis=0
        )
        return part

    def constant(self, value: Any, name: str = "") -> str:
        """Name of a constant of the value's type, which is stored once.

        A literal of the graph, as an axis, is called by its value.
        """
        array = np.asarray(value)
        name = name or f"{array.dtype} {array.tolist()}"
        if name not in self.constants:
            self.constants[name] = numpy_helper.from_array(array, name)
        return name

    def numbered(self, values: Sequence[Floats]) -> int:
        """The number of some arrays; equal ones have the same, and are stored once."""
        stack = np.stack(values)
        contents = stack.shape, stack.tobytes()
        return self._numbers.setdefault(contents, len(self._numbers))

    def by_decision_point(self, values: Sequence[Any], name: str) -> str:
        """Name of the value, at the decision point that is asked for, of a constant.

        Values that differ are stored one after another, and those that do not as one.
        """
        if all(np.array_equal(value, values[0]) for value in values):
            return self.constant(values[0], name)
        stack = self.constant(np.stack(values), name)
        return self.node("Gather", stack, self.decision_point, axis=0)

    def by_decision_point_small(self, values: Sequence[Any], name: str) -> str:
        """As `by_decision_point`, stored in the smallest type that holds all values
        exactly.

        A single value is converted when the model is loaded, and costs a decision
        nothing.
        """
        small = smallest(np.stack(values), STORED)
        stored = self.by_decision_point(list(small), name)
        if small.dtype == np.float64:
            return stored
        return self.node("Cast", stored, to=TensorProto.DOUBLE)

    def shifted(self, x: str, y: str, shifts: Sequence[int], name: str) -> str:
        """Name of a whole product of matrices, divided by 2^shift and rounded, with a
        shift for each decision point, or one for all, and a name for these factors."""
        factors = self.by_decision_point([2.0**-shift for shift in shifts], name)
        product = self.node("MatMul", x, y)
        return self.node("Round", self.node("Mul", product, factors))

    def squared_length(self, x: str) -> str:
        """Name of the squared lengths (n, 1) of vectors x (n, p)."""
        return self.node("ReduceSumSquare", x, [1], keepdims=1)

    def node(
        self,
        operator: str,
        *inputs: Any,
        output: str = "",
        **attributes: Any,
    ) -> str:
        """Add an operator of one output and return its name; an equal one is not added
        again.

        Args:
            operator: ONNX's.
            inputs: names of values, and numbers or arrays, which become constants.
            output: its name; one of its own where it is empty.
            attributes: of the operator.
        """
        names = self._names(inputs)
        key = (operator, *names, *sorted(attributes.items()))
        if output or key not in self._results:
            self._results[key] = self.nodes(operator, names, [output], **attributes)[0]
        return self._results[key]

    def nodes(
        self,
        operator: str,
        inputs: Sequence[Any],
        outputs: Sequence[str],
        **attributes: Any,
    ) -> list[str]:
        """Add an operator, as `node`; returns the names of its outputs."""
        place = len(self.made)
        names = [name or f"{operator} {place} {i}" for i, name in enumerate(outputs)]
        # skl2onnx orders nodes by their names, and those without one by their addresses.
        proto = helper.make_node(
            operator, self._names(inputs), names, name=str(place), **attributes
        )
        self.made.append(proto)
        return names

    def _names(self, inputs: Sequence[Any]) -> list[str]:
        return [i if isinstance(i, str) else self.constant(i) for i in inputs]

    def clipped(self, x: str, limits: Sequence[float], name: str) -> tuple[str, str]:
        """Whole numbers (n, m) cut off at plus and minus a limit for each decision
        point, or one for all; the limits have a name.

        Returns:
            Names of the numbers, and of their summed excess (n, 1), which is 0 within
            the limits and not finite where a number is not.
        """
        high = self.by_decision_point(limits, name)
        low = self.by_decision_point([-x for x in limits], f"negative {name}")
        inside = self.node("Clip", x, low, high)
        excess = self.node("Sub", x, inside)
        return inside, self.node("ReduceL1", excess, [1], keepdims=1)


def product(
    build: Builder,
    x: str,
    decision_points: Sequence[Projection],
    components: int,
    name: str,
) -> tuple[str, str]:
    """Nodes that multiply features (n, p) by the weights of a projection for each
    decision point; the constants' names end with a name.

    Returns:
        Names of the whole products (n, components) in the grid's units, and of how much
        was cut off from features to get them, as in `project`.
    """
    means = [p.mean_ for p in decision_points]
    centred = build.node("Sub", x, build.by_decision_point(means, f"means {name}"))
    gains = build.by_decision_point(
        [p.gain_ / p.grid_.step for p in decision_points], f"gains {name}"
    )
    steps = build.node("Round", build.node("Mul", centred, gains))
    steps, far = build.clipped(steps, [MOST_STEPS], "most steps")
    # A step over a unit is a power of two, so that the products' sums are still exact.
    weights = [p.weights_ * (p.grid_.step / p.grid_.unit) for p in decision_points]
    columns = build.by_decision_point_small(
        widened(weights, components), f"weights {name}"
    )
    return build.node("Round", build.node("MatMul", steps, columns)), far


def project(
    build: Builder, spaces: Sequence[FittedSpace], width: int, number: int
) -> tuple[str, str]:
    """Nodes that take `features` (n, width) to whole coordinates; see
    `train.model.projection.Projection`.

    Decision points that take the same columns share nodes. Of several such nodes, those
    of the decision point asked for count.

    Args:
        build: takes the nodes.
        spaces: of each decision point.
        width: the number of features.
        number: of the space, by which its constants are called.

    Returns:
        Names of the coordinates (n, c) in the grid's units, and of how much was cut off
        to get them (n, 1): 0 within the training set's reach, not finite where a
        feature is not.
    """
    count = len(spaces)
    projections = [space.projection for space in spaces]
    columns = [space.columns for space in spaces]
    components = max(p.weights_.shape[1] for p in projections)
    starts = changes(columns)
    products = []
    for start, end in zip(starts, [*starts[1:], count], strict=True):
        part = build.among(range(start, end), count)
        name = f"of space {number} from {start}"
        selected = "features"
        if len(columns[start]) < width:
            places = build.constant(columns[start], f"columns {name}")
            selected = build.node("Gather", selected, places, axis=1)
        of_part = projections[start:end]
        products.append(product(part, selected, of_part, components, name))
    rounded, far = products[0]
    for start, (later, later_far) in zip(starts[1:], products[1:], strict=True):
        is_earlier = build.by_decision_point(
            [point < start for point in range(count)], f"points before {start}"
        )
        rounded = build.node("Where", is_earlier, rounded, later)
        far = build.node("Where", is_earlier, far, later_far)
    limits = [p.grid_.limit for p in projections]
    z, farther = build.clipped(rounded, limits, f"limits of space {number}")
    off = build.node("Add", far, farther)
    if min(map(len, columns)) < width:
        # A feature that another task or decision point takes must be finite too.
        zeros = build.node("Mul", "features", 0.0)
        off = build.node("Add", off, build.node("ReduceL1", zeros, [1], keepdims=1))
    return z, off


def changes(arrays: Sequence[Integers]) -> list[int]:
    """Where arrays differ from the one before; the first counts."""
    places = [0]
    for i in range(1, len(arrays)):
        if not np.array_equal(arrays[i], arrays[i - 1]):
            places.append(i)
    return places


def widened(arrays: Sequence[Floats], width: int) -> list[Floats]:
    """Arrays with columns of zeros added up to a width, for coordinates that are always
    0."""
    return [
        np.pad(array, [(0, 0)] * (array.ndim - 1) + [(0, width - array.shape[-1])])
        for array in arrays
    ]
