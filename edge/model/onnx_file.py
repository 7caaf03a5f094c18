"""Contents of a model file, checked before ONNX Runtime loads it.

ONNX Runtime would follow a path to another file, and would run any operator that it knows. Reading
a few fields of the ONNX protobuf (onnx.proto3) shows that a file refers to nothing outside itself
and uses only the operators of an exported model, in a graph of its size.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError

OPERATORS = frozenset(
    "Add ArgMax Cast Clip Div Gather GatherElements GatherND Gemm LessOrEqual MatMul Max Mul Pad "
    "ReduceL1 ReduceMean ReduceSum ReduceSumSquare Round Sqrt Squeeze Sub TopK Where".split()
)
"""The operators of an exported model, all of the standard domain."""
MOST_NODES = 1000
"""An exported model has about 20 nodes, and 15 more for each task."""

GRAPH, OPSETS, METADATA, FUNCTIONS = 7, 8, 14, 25
"""Fields of a ModelProto."""
NODES, INITIALIZERS, SPARSE = 1, 5, 15
"""Fields of a GraphProto."""
OPERATOR, ATTRIBUTES, DOMAIN = 4, 5, 7
"""Fields of a NodeProto."""
NUMBERS = frozenset({1, 2, 3, 4, 7, 8, 20})
"""Fields of an attribute that is a number or several: it holds no tensor and no graph."""
EXTERNAL_DATA, DATA_LOCATION = 13, 14
"""Fields of a TensorProto."""

TYPES = {1: "<f4", 7: "<i8", 9: "|b1", 11: "<f8"}
"""{type of a TensorProto: its numbers}."""

Message = dict[int, list[int | memoryview]]
"""{field number: its values}: a number, or the bytes of a text or of a message within."""


@dataclass
class Contents:
    """Operators, metadata and opsets of a model file."""

    operators: list[tuple[str, str]] = field(default_factory=list)
    """(domain, operator) of each node."""
    metadata: dict[str, str] = field(default_factory=dict)
    opsets: dict[str, int | memoryview] = field(default_factory=dict)
    """{domain: version}."""
    external: bool = False
    """A tensor's values lie in another file."""
    unusual: bool = False
    """The model holds functions, graphs within graphs, sparse tensors or tensors in attributes."""


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")


def _fields(value: int | memoryview) -> Iterator[tuple[int, int | memoryview, memoryview]]:
    """Number, value and bytes of each field of a protobuf message (protobuf.dev, Encoding)."""
    if isinstance(value, int):
        raise ValueError("a number where a message belongs")
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
            raise ValueError("a field of an unknown kind, or one that runs past its message")
        at += size
        yield key >> 3, value[at - size : at], value[first:at]


def _message(value: int | memoryview) -> Message:
    """The values of a protobuf message's fields."""
    fields: Message = defaultdict(list)
    for number, content, _ in _fields(value):
        fields[number].append(content)
    return fields


def _messages(message: Message, number: int) -> Sequence[Message]:
    return [_message(value) for value in message.get(number, ())]


def _text(message: Message, number: int) -> str:
    """The last of a field's values, as protobuf takes them; empty without a value."""
    values = message.get(number, [b""])
    if isinstance(values[-1], int):
        raise ValueError("a number where a text belongs")
    return bytes(values[-1]).decode("utf-8")


def _walk(data: bytes) -> Contents:
    """The contents of a model file; ValueError or IndexError where it is none."""
    contents = Contents()
    model = _message(memoryview(data))
    contents.unusual = FUNCTIONS in model
    for opset in _messages(model, OPSETS):
        contents.opsets[_text(opset, 1)] = opset.get(2, [0])[-1]
    for entry in _messages(model, METADATA):
        contents.metadata[_text(entry, 1)] = _text(entry, 2)
    for graph in _messages(model, GRAPH):
        contents.unusual |= SPARSE in graph
        for node in _messages(graph, NODES):
            contents.operators.append((_text(node, DOMAIN), _text(node, OPERATOR)))
            for attribute in _messages(node, ATTRIBUTES):
                contents.unusual |= not attribute.keys() <= NUMBERS
        for tensor in _messages(graph, INITIALIZERS):
            contents.external |= EXTERNAL_DATA in tensor
            contents.external |= any(tensor.get(DATA_LOCATION, ()))
    return contents


def read(data: bytes, name: str) -> Contents:
    """The contents of a model file.

    Raises:
        InputError: it is not an ONNX model; the sentence names the file.
    """
    try:
        contents = _walk(data)
    except (IndexError, ValueError):  # a field that runs past its message, or of no known kind
        contents = Contents()
    if not contents.operators or not contents.opsets:
        raise InputError(f"{name}: not an ONNX model; copy or export it again")
    return contents


def check(contents: Contents, name: str) -> None:
    """Refuse contents that no exported model has.

    Raises:
        InputError: one sentence that names the file.
    """
    if contents.external:
        raise InputError(f"{name}: its weights lie in another file; a model must be one file")
    foreign = sorted(
        f"operator {domain}.{operator}" if domain else f"operator {operator}"
        for domain, operator in contents.operators
        if domain not in ("", "ai.onnx") or operator not in OPERATORS
    )
    if contents.unusual:
        foreign.append("functions, inner graphs or sparse tensors")
    if len(contents.operators) > MOST_NODES:
        foreign.append(f"{len(contents.operators)} nodes")
    if foreign:
        raise InputError(f"{name}: has {foreign[0]}, as no exported model has; export it again")


def graph(data: bytes) -> tuple[dict[str, tuple[str, list[str]]], dict[str, NDArray[Any]]]:
    """{output: (operator, inputs)} and {name: constant} of an exported model's bytes."""
    nodes: dict[str, tuple[str, list[str]]] = {}
    constants: dict[str, NDArray[Any]] = {}
    for part in _messages(_message(memoryview(data)), GRAPH):
        for node in _messages(part, NODES):
            inputs, outputs = ([str(name, "utf-8") for name in node.get(i, ())] for i in (1, 2))  # type: ignore[arg-type]
            nodes |= dict.fromkeys(outputs, (_text(node, OPERATOR), inputs))
        for tensor in _messages(part, INITIALIZERS):
            kind: Any = tensor[2][-1]
            if kind in TYPES:
                values: Any = np.frombuffer(tensor[9][-1], TYPES[kind])  # type: ignore[arg-type]
                constants[_text(tensor, 8)] = values.reshape(tensor.get(1, []))
    return nodes, constants


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
    graph: int | memoryview, constants: Mapping[str, NDArray[Any]]
) -> Iterator[bytes | memoryview]:
    kinds = {np.dtype(kind): number for number, kind in TYPES.items()}
    for number, value, unchanged in _fields(graph):
        if number == INITIALIZERS and (name := _text(_message(value), 8)) in constants:
            array = np.ascontiguousarray(constants[name])
            tensor = [_field(1, size) for size in array.shape]
            tensor += [_field(2, kinds[array.dtype]), _field(8, name.encode())]
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
