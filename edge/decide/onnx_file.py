"""Contents of a model file, checked before ONNX Runtime loads it.

ONNX Runtime would follow a path to another file, and would run any operator that it
knows. Reading a few fields of the ONNX protobuf (onnx.proto3) shows that a file refers
to nothing outside itself and uses only the operators of an exported model, in a graph
of its size.
"""

import hashlib
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from edge.arrays import Array
from edge.errors import InputError

OPERATORS = {
    "Add",
    "ArgMax",
    "Cast",
    "Clip",
    "Div",
    "Gather",
    "GatherElements",
    "GatherND",
    "Gemm",
    "LessOrEqual",
    "MatMul",
    "Max",
    "Mul",
    "Pad",
    "ReduceL1",
    "ReduceMean",
    "ReduceSum",
    "ReduceSumSquare",
    "Round",
    "Sqrt",
    "Squeeze",
    "Sub",
    "TopK",
    "Where",
}
"""The operators of an exported model, all of the standard domain."""
OPSET = 18
"""The version of ONNX's operators in an exported model."""
MOST_NODES = 1000
"""An exported model has about 20 nodes, and 15 more for each task."""

GRAPH = 7
OPERATOR_SETS = 8
METADATA = 14
FUNCTIONS = 25
"""Fields of a ModelProto."""
NODES = 1
INITIALIZERS = 5
INPUTS = 11
SPARSE = 15
"""Fields of a GraphProto."""
OPERATOR = 4
ATTRIBUTES = 5
DOMAIN = 7
"""Fields of a NodeProto."""
NUMBERS = frozenset({1, 2, 3, 4, 7, 8, 20})
"""Fields of an attribute that is a number, a text or several numbers, not a tensor or a
graph."""
DIMENSIONS = 1
TYPE = 2
TENSOR_NAME = 8
RAW_DATA = 9
EXTERNAL_DATA = 13
DATA_LOCATION = 14
"""Fields of a TensorProto."""
TYPES = {1: "<f4", 5: "<i2", 7: "<i8", 9: "|b1", 11: "<f8"}
"""{type of a TensorProto: its numbers} of those in an exported model."""

DIGEST = b"rX\n\x14edge-classify-digest\x12@"
"""Begins the last field of an exported model: an entry of metadata of `DIGITS` digits,
the SHA-256 of all bytes before. No model of an earlier version has it."""
DIGITS = 64
DAMAGED = "was changed or damaged since its export; copy or export it again"

UNUSUAL = "functions, inner graphs or sparse tensors"

Message = dict[int, list[Any]]
"""{field number: its values}: numbers, or memoryviews of the bytes of a text or an
inner message. A damaged file may have one where the other belongs."""


@dataclass
class Contents:
    """Constants and metadata of a model file."""

    data: bytes
    """The whole file."""
    intact: bool = True
    """Whether its digest is there and right."""
    nodes: int = 0
    """How many there are."""
    constants: dict[str, Array] = field(default_factory=dict)
    """By their names."""
    metadata: dict[str, str] = field(default_factory=dict)
    foreign: list[str] = field(default_factory=list)
    """Its contents that no exported model has, in words."""


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")


def message_of(value: memoryview) -> Message:
    """The values of a protobuf message's fields (protobuf.dev, Encoding)."""
    fields: Message = defaultdict(list)
    at = 0
    while at < len(value):
        key, at = _varint(value, at)
        size: Any = {1: 8, 5: 4}.get(key & 7)
        if key & 7 in (0, 2):
            size, at = _varint(value, at)
        content = size
        if key & 7:
            if at + size > len(value):  # a TypeError where the field's kind is unknown
                raise ValueError("a field that runs past its message")
            content = value[at : at + size]
            at += size
        fields[key >> 3].append(content)
    return fields


def messages(message: Message, number: int) -> list[Message]:
    """The inner messages of a field."""
    return [message_of(value) for value in message.get(number, ())]


def text_of(message: Message, number: int) -> str:
    """The last of a field's values, as protobuf takes them; empty without a value."""
    return str(message.get(number, [b""])[-1], "utf-8")


def read(data: bytes, name: str) -> Contents:
    """The contents of a model file.

    Raises:
        InputError: it is not an ONNX model, or was changed since it was exported; the
            sentence names the file.
    """
    signed = memoryview(data)[:-DIGITS]
    digits = data[-DIGITS:]
    intact = digits == hashlib.sha256(signed).hexdigest().encode()
    if not intact and (digits.isalnum() or bytes(signed[-len(DIGEST) :]) == DIGEST):
        raise InputError(f"{name}: {DAMAGED}")
    contents = Contents(data, intact)
    try:
        _read_model(message_of(memoryview(data)), contents)
    # A field that runs past its message or is of no known kind; a number in place of
    # bytes; a constant of an unknown type, or of another size than it says.
    except (LookupError, TypeError, ValueError):
        contents.nodes = 0
    if not contents.nodes:
        raise InputError(f"{name}: not an ONNX model; copy or export it again")
    if contents.nodes > MOST_NODES:
        contents.foreign.append(f"{contents.nodes} nodes")
    return contents


def _read_model(model: Message, contents: Contents) -> None:
    """Take in the metadata and the graph."""
    if FUNCTIONS in model:
        contents.foreign.append(UNUSUAL)
    versions = [fields.get(2) for fields in messages(model, OPERATOR_SETS)]
    if versions != [[OPSET]]:
        contents.foreign.append(f"operators of another version than {OPSET}")
    for entry in messages(model, METADATA):
        contents.metadata[text_of(entry, 1)] = text_of(entry, 2)
    for graph in messages(model, GRAPH):
        _read_graph(graph, contents)


def _read_graph(graph: Message, contents: Contents) -> None:
    """Take in the nodes and constants of a graph."""
    if SPARSE in graph:
        contents.foreign.append(UNUSUAL)
    for fields in messages(graph, NODES):
        contents.nodes += 1
        contents.foreign.extend(_foreign_of_node(fields))
    for tensor in messages(graph, INITIALIZERS):
        if EXTERNAL_DATA in tensor or any(tensor.get(DATA_LOCATION, ())):
            contents.foreign.append("weights in another file")
        else:
            numbers = np.frombuffer(tensor[RAW_DATA][-1], TYPES[tensor[TYPE][-1]])
            shape = tensor.get(DIMENSIONS, [])
            contents.constants[text_of(tensor, TENSOR_NAME)] = numbers.reshape(shape)
    names = {text_of(value, 1) for value in messages(graph, INPUTS)}
    for name in sorted(names - {"features", "decision_point"}):
        contents.foreign.append(f"an input {name}")


def _foreign_of_node(fields: Message) -> Iterator[str]:
    """What of a node no exported model has."""
    domain = text_of(fields, DOMAIN)
    operator = text_of(fields, OPERATOR)
    if domain not in ("", "ai.onnx") or operator not in OPERATORS:
        yield f"operator {domain}.{operator}".replace(" .", " ")
    for attribute in messages(fields, ATTRIBUTES):
        if not attribute.keys() <= NUMBERS:
            yield UNUSUAL


def check(contents: Contents, name: str) -> None:
    """Refuse contents that no exported model has.

    Raises:
        InputError: one sentence that names the file.
    """
    for reason in contents.foreign:
        raise InputError(
            f"{name}: has {reason}, as no exported model has; export it again"
        )
    if not contents.intact:
        raise InputError(f"{name}: {DAMAGED}")
