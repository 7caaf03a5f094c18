"""Contents of a model file, checked before ONNX Runtime loads it.

ONNX Runtime would follow a path to another file, and would run any operator that it
knows. Reading a few fields of the ONNX protobuf (onnx.proto3) shows that a file refers
to nothing outside itself and uses only the operators of an exported model, in a graph
of its size.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError

OPERATORS = frozenset(
    "Add ArgMax Cast Clip Div Gather GatherElements GatherND Gemm LessOrEqual MatMul "
    "Max Mul Pad "
    "ReduceL1 ReduceMean ReduceSum ReduceSumSquare Round Sqrt Squeeze Sub TopK Where".split()
)
"""The operators of an exported model, all of the standard domain."""
MOST_NODES = 1000
"""An exported model has about 20 nodes, and 15 more for each task."""

GRAPH, METADATA, FUNCTIONS = 7, 14, 25
"""Fields of a ModelProto."""
NODES, INITIALIZERS, SPARSE = 1, 5, 15
"""Fields of a GraphProto."""
OPERATOR, ATTRIBUTES, DOMAIN = 4, 5, 7
"""Fields of a NodeProto."""
NUMBERS = frozenset({1, 2, 3, 4, 7, 8, 20})
"""Fields of an attribute that is a number, a text or several numbers, not a tensor or a
graph."""
TENSOR_NAME, EXTERNAL_DATA, DATA_LOCATION = 8, 13, 14
"""Fields of a TensorProto."""

TYPES = {1: "<f4", 7: "<i8", 9: "|b1", 11: "<f8"}
"""{type of a TensorProto: its numbers}."""

Message = dict[int, list[Any]]
"""{field number: its values}: numbers, or memoryviews of the bytes of a text or an
inner message. A damaged file may have one where the other belongs."""


class Node(NamedTuple):
    """A node of the graph."""

    operator: str
    inputs: list[str]
    outputs: list[str]


@dataclass
class Contents:
    """Nodes, constants and metadata of a model file."""

    data: bytes
    """The whole file."""
    nodes: list[Node] = field(default_factory=list)
    tensors: dict[str, Message] = field(default_factory=dict)
    """{name of a constant: the fields of its TensorProto}."""
    metadata: dict[str, str] = field(default_factory=dict)
    foreign: list[str] = field(default_factory=list)
    """Its contents that no exported model has, in words."""

    @cached_property
    def makers(self) -> dict[str, Node]:
        """{output: its node}."""
        return {output: node for node in self.nodes for output in node.outputs}

    def constant(self, name: str, point: int | None = None) -> NDArray[Any]:
        """A constant, or the constant that a value is taken from.

        Args:
            name: of the constant, or of a value that `Gather` and `Cast` make of one.
            point: the decision point at which to take such a value; None for all of
                them.

        Raises:
            KeyError: the graph has no such constant.
        """
        if name in self.tensors:
            tensor: Any = self.tensors[name]
            return np.frombuffer(tensor[9][-1], TYPES[tensor[2][-1]]).reshape(
                tensor.get(1, [])
            )
        node = self.makers[name]
        values = self.constant(node.inputs[0], point)
        return values if point is None or node.operator != "Gather" else values[point]

    def path(self, output: str) -> list[tuple[str, list[str]]]:
        """The nodes from the features to an output, through the first input of each.

        Returns:
            Operator and further inputs of each node, in the order of computation.
        """
        nodes = []
        while output in self.makers:
            node = self.makers[output]
            output, *further = node.inputs
            nodes.append((node.operator, further))
        return nodes[::-1]


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")


def _fields(value: memoryview) -> Iterator[tuple[int, Any, memoryview]]:
    """Number, value and bytes of each field of a protobuf message (protobuf.dev,
    Encoding)."""
    at = 0
    while at < len(value):
        first = at
        key, at = _varint(value, at)
        size = {1: 8, 5: 4}.get(key & 7)
        if key & 7 == 0:
            number, at = _varint(value, at)
            yield key >> 3, number, value[first:at]
            continue
        if key & 7 == 2:
            size, at = _varint(value, at)
        if size is None or at + size > len(value):
            raise ValueError(
                "a field of an unknown kind, or one that runs past its message"
            )
        at += size
        yield key >> 3, value[at - size : at], value[first:at]


def _message(value: memoryview) -> Message:
    """The values of a protobuf message's fields."""
    fields: Message = defaultdict(list)
    for number, content, _ in _fields(value):
        fields[number].append(content)
    return fields


def _messages(message: Message, number: int) -> Sequence[Message]:
    return [_message(value) for value in message.get(number, ())]


def _texts(message: Message, number: int) -> list[str]:
    return [str(value, "utf-8") for value in message.get(number, [])]


def _text(message: Message, number: int) -> str:
    """The last of a field's values, as protobuf takes them; empty without a value."""
    return ["", *_texts(message, number)][-1]


def read(data: bytes, name: str) -> Contents:
    """The contents of a model file.

    Raises:
        InputError: it is not an ONNX model; the sentence names the file.
    """
    contents = Contents(data)
    foreign = contents.foreign
    try:
        model = _message(memoryview(data))
        unusual = FUNCTIONS in model
        for entry in _messages(model, METADATA):
            contents.metadata[_text(entry, 1)] = _text(entry, 2)
        for graph in _messages(model, GRAPH):
            unusual |= SPARSE in graph
            for fields in _messages(graph, NODES):
                domain, operator = _text(fields, DOMAIN), _text(fields, OPERATOR)
                contents.nodes.append(
                    Node(operator, _texts(fields, 1), _texts(fields, 2))
                )
                if domain not in ("", "ai.onnx") or operator not in OPERATORS:
                    foreign.append(f"operator {domain}.{operator}".replace(" .", " "))
                for attribute in _messages(fields, ATTRIBUTES):
                    unusual |= not attribute.keys() <= NUMBERS
            for tensor in _messages(graph, INITIALIZERS):
                contents.tensors[_text(tensor, TENSOR_NAME)] = tensor
                if EXTERNAL_DATA in tensor or any(tensor.get(DATA_LOCATION, ())):
                    foreign.append("weights in another file")
    # A field that runs past its message or is of no known kind; a number in place of
    # bytes.
    except (IndexError, TypeError, ValueError):
        contents.nodes.clear()
    if not contents.nodes:
        raise InputError(f"{name}: not an ONNX model; copy or export it again")
    if unusual:
        foreign.append("functions, inner graphs or sparse tensors")
    if len(contents.nodes) > MOST_NODES:
        foreign.append(f"{len(contents.nodes)} nodes")
    return contents


def check(contents: Contents, name: str) -> None:
    """Refuse contents that no exported model has.

    Raises:
        InputError: one sentence that names the file.
    """
    for reason in contents.foreign:
        raise InputError(
            f"{name}: has {reason}, as no exported model has; export it again"
        )


def rewritten(
    data: bytes, constants: Mapping[str, NDArray[Any]], metadata: Mapping[str, str]
) -> bytes:
    """A model's bytes with other values of some constants, and other metadata."""
    model: list[bytes | memoryview] = []
    for number, value, unchanged in _fields(memoryview(data)):
        if number == GRAPH:
            model.append(_field(GRAPH, b"".join(_constants_changed(value, constants))))
        elif number == METADATA and (key := _text(_message(value), 1)) in metadata:
            entry = _field(1, key.encode()) + _field(2, metadata[key].encode())
            model.append(_field(METADATA, entry))
        else:
            model.append(unchanged)
    return b"".join(model)


def _constants_changed(
    graph: memoryview, constants: Mapping[str, NDArray[Any]]
) -> Iterator[bytes | memoryview]:
    kinds = {np.dtype(kind): number for number, kind in TYPES.items()}
    for number, value, unchanged in _fields(graph):
        if (
            number == INITIALIZERS
            and (name := _text(_message(value), TENSOR_NAME)) in constants
        ):
            array = np.ascontiguousarray(constants[name])
            tensor = [_field(1, size) for size in array.shape]
            tensor += [
                _field(2, kinds[array.dtype]),
                _field(TENSOR_NAME, name.encode()),
            ]
            yield _field(INITIALIZERS, b"".join([*tensor, _field(9, array.tobytes())]))
        else:
            yield unchanged


def _field(number: int, value: int | bytes) -> bytes:
    """A field of a protobuf message: a number, or bytes."""
    if isinstance(value, int):
        return _encoded(number << 3) + _encoded(value)
    return _encoded(number << 3 | 2) + _encoded(len(value)) + value


def _encoded(value: int) -> bytes:
    """A varint."""
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*out, value])
