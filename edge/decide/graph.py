"""The exported graph in numpy: any value of it by name, with ONNX Runtime's bits.

Each operator follows its definition in ONNX's operator set 18
(onnx.ai/onnx/operators). All that decides is made of whole numbers below 2^53, which no
order of summation rounds, so that numpy and ONNX Runtime agree to the last bit.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.decide.onnx_file import Contents, Message, Node, messages, text_of
from edge.errors import InputError

TYPES = {1: "<f4", 5: "<i2", 7: "<i8", 9: "|b1", 11: "<f8"}
"""{type of a TensorProto: its numbers}."""
TENSORS = {
    1: "tensor(float)",
    5: "tensor(int16)",
    7: "tensor(int64)",
    9: "tensor(bool)",
    11: "tensor(double)",
}
"""{type of a TensorProto: its name in ONNX Runtime}."""
Declared = tuple[str, list[int | None]]
"""Type and shape of an input or output."""
Attributes = Mapping[str, int]


def _arg_max(x: Array, attributes: Attributes) -> Array:
    axis = attributes.get("axis", 0)
    keep = bool(attributes.get("keepdims", 1))
    return np.asarray(x.argmax(axis=axis, keepdims=keep), dtype=np.int64)


def _cast(x: Array, attributes: Attributes) -> Array:
    return x.astype(TYPES[attributes["to"]])


def _gather(x: Array, indices: Array, attributes: Attributes) -> Array:
    return x.take(indices, axis=attributes.get("axis", 0))


def _gather_elements(x: Array, indices: Array, attributes: Attributes) -> Array:
    return np.take_along_axis(x, indices, axis=attributes.get("axis", 0))


def _gather_nd(x: Array, indices: Array, attributes: Attributes) -> Array:
    """Elements at coordinates (..., r) behind the batch axes."""
    batch = attributes.get("batch_dims", 0)
    coordinates = list(np.moveaxis(indices, -1, 0))
    grid = np.indices(coordinates[0].shape, sparse=True)
    return np.asarray(x[(*grid[:batch], *coordinates)])


def _pad(x: Array, pads: Array, value: Array) -> Array:
    sides = pads.reshape(2, -1).T.tolist()
    return np.pad(x, sides, constant_values=value.item())


def _reduction(combine: Callable[..., Array]) -> Callable[..., Array]:
    """An operator that combines the values along some axes."""

    def operator(x: Array, axes: Array, attributes: Attributes) -> Array:
        keep = bool(attributes.get("keepdims", 1))
        return np.asarray(combine(x, axis=tuple(axes.tolist()), keepdims=keep))

    return operator


def _squeeze(x: Array, axes: Array | None = None) -> Array:
    return x.squeeze(None if axes is None else tuple(axes.tolist()))


def _top_k(x: Array, k: Array, attributes: Attributes) -> tuple[Array, Array]:
    """The smallest (or largest) values, and their places; of equal ones the first."""
    axis = attributes.get("axis", -1)
    keys = -x if attributes.get("largest", 1) else x
    order = keys.argsort(axis=axis, kind="stable")
    places = order.take(np.arange(int(k.item())), axis=axis)
    return np.take_along_axis(x, places, axis=axis), places


def _plain(function: Callable[..., Any]) -> Callable[..., Array]:
    """An operator without attributes."""

    def operator(*inputs: Array, attributes: Attributes) -> Array:
        return np.asarray(function(*inputs))

    return operator


OPERATORS: dict[str, Callable[..., Any]] = {
    "Add": _plain(np.add),
    "ArgMax": _arg_max,
    "Cast": _cast,
    "Clip": _plain(np.clip),
    "Div": _plain(np.divide),
    "Gather": _gather,
    "GatherElements": _gather_elements,
    "GatherND": _gather_nd,
    "Gemm": _plain(lambda a, b, c: a @ b + c),
    "LessOrEqual": _plain(np.less_equal),
    "MatMul": _plain(np.matmul),
    "Max": _plain(lambda *inputs: reduce(np.maximum, inputs)),
    "Mul": _plain(np.multiply),
    "Pad": _plain(_pad),
    "ReduceL1": _reduction(lambda x, **axes: np.abs(x).sum(**axes)),
    "ReduceMean": _reduction(np.mean),
    "ReduceSum": _reduction(np.sum),
    "ReduceSumSquare": _reduction(lambda x, **axes: np.square(x).sum(**axes)),
    "Round": _plain(np.rint),
    "Sqrt": _plain(np.sqrt),
    "Squeeze": _plain(_squeeze),
    "Sub": _plain(np.subtract),
    "TopK": _top_k,
    "Where": _plain(np.where),
}
"""By name. Each takes its inputs and `attributes`, and gives its output or outputs."""


def _constant(tensor: Any) -> Array:
    """The numbers of a TensorProto."""
    values = np.frombuffer(tensor[9][-1], TYPES[tensor[2][-1]])
    return values.reshape(tensor.get(1, []))


def _declared(value: Message) -> tuple[str, Declared]:
    """Name, and type and shape, of a ValueInfoProto; a size that is not known is
    None."""
    kind = "another type"
    sizes: list[int | None] = []
    for declared in messages(value, 2):
        for tensor in messages(declared, 1):
            kind = TENSORS.get(tensor[1][-1], kind)
            for shape in messages(tensor, 2):
                for dimension in messages(shape, 1):
                    sizes.append(dimension[1][-1] if 1 in dimension else None)
    return text_of(value, 1), (kind, sizes)


class Graph:
    """A graph whose values can be asked for by name.

    >>> from edge import demo
    >>> from edge.decide import onnx_file
    >>> contents = onnx_file.read(demo.MODEL.read_bytes(), "the demo")
    >>> features = np.zeros((1, 120))
    >>> Graph(contents).run(["mobility_label"], {"features": features})[0].shape
    (1,)

    It is an engine of `edge.decide.engines`.

    Attributes:
        makers: {value: the node that makes it}.
        constants: {name: value}.
        inputs: {input: its type and shape}, as the file declares them.
        outputs: {output: its type and shape}, as the file declares them.
    """

    name = "numpy"

    def __init__(self, contents: Contents) -> None:
        """Read the constants of a model file.

        Raises:
            InputError: the file uses an operator in a form that no export writes.
        """
        tensors = contents.tensors.items()
        self.constants = {name: _constant(tensor) for name, tensor in tensors}
        self.inputs = dict(map(_declared, contents.inputs))
        self.outputs = dict(map(_declared, contents.outputs))
        self.makers: dict[str, Node] = {}
        self._plans: dict[tuple[str, ...], list[Node]] = {}
        self._nodes = contents.nodes
        for node in contents.nodes:
            for output in node.outputs:
                self.makers[output] = node

    def run(self, names: Sequence[str], inputs: Mapping[str, Array]) -> list[Array]:
        """Values of the graph, in the order of the names.

        Args:
            names: of outputs, or of any other value.
            inputs: {name: value}; they replace constants of the same name.

        Raises:
            InputError: the graph has no such value, or cannot compute it.
        """
        values: dict[str, Array] = {**self.constants, **inputs}
        try:
            with np.errstate(all="ignore"):
                for node in self._plan(tuple(names)):
                    self._compute(node, values)
            return [values[name] for name in names]
        except (
            ArithmeticError,
            LookupError,
            MemoryError,
            TypeError,
            ValueError,
        ) as error:
            reason = f"{type(error).__name__}: {error}"
            raise InputError(f"the graph cannot be computed ({reason})") from None

    def _compute(self, node: Node, values: dict[str, Array]) -> None:
        inputs = [values[name] for name in node.inputs]
        computed = OPERATORS[node.operator](*inputs, attributes=node.attributes)
        if len(node.outputs) == 1:
            computed = (computed,)
        for name, value in zip(node.outputs, computed, strict=True):
            values[name] = value

    def _plan(self, names: tuple[str, ...]) -> list[Node]:
        """The nodes that the values need, in the order of computation."""
        if names not in self._plans:
            values = set(names)
            plan = []
            # A file holds its nodes in the order of computation.
            for node in reversed(self._nodes):
                if not values.isdisjoint(node.outputs):
                    values.update(node.inputs)
                    plan.append(node)
            self._plans[names] = plan[::-1]
        return self._plans[names]

    def path(self, output: str) -> list[Node]:
        """The nodes from the features to a value at the full window.

        They lead through the first input of each, and through the last of a `Where`,
        which chooses between the values of earlier decision points and this one.
        """
        nodes = []
        while output in self.makers:
            node = self.makers[output]
            nodes.append(node)
            output = node.inputs[-1 if node.operator == "Where" else 0]
        return nodes[::-1]
