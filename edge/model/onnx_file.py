"""What a model file holds, read before ONNX Runtime is trusted with it.

A few fields of the ONNX protobuf (onnx.proto3) are enough to see that a file refers to nothing
outside itself and uses only the operators that an exported model has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from edge.errors import InputError

OPERATORS = frozenset(
    {
        "Add",
        "And",
        "ArgMax",
        "Cast",
        "Concat",
        "CumSum",
        "Div",
        "Gather",
        "GatherElements",
        "Identity",
        "If",
        "LessOrEqual",
        "Less",
        "MatMul",
        "Mul",
        "Pad",
        "Not",
        "ReduceMax",
        "ReduceMin",
        "ReduceSum",
        "ReduceSumSquare",
        "Slice",
        "Sqrt",
        "Squeeze",
        "Sub",
        "TopK",
        "Unsqueeze",
        "Where",
    }
)
"""The operators, all of the standard domain, that an exported model may use."""

MODEL_OPSET, MODEL_GRAPH, MODEL_METADATA, MODEL_FUNCTIONS = 8, 7, 14, 25
NODE_OP, NODE_ATTRIBUTE, NODE_DOMAIN = 4, 5, 7
GRAPH_NODE, GRAPH_INITIALIZER = 1, 5
ATTRIBUTE_TENSOR, ATTRIBUTE_GRAPH, ATTRIBUTE_GRAPHS = 5, 6, 11
TENSOR_EXTERNAL_DATA, TENSOR_LOCATION = 13, 14
DEEPEST = 8


@dataclass
class Contents:
    """Operators, metadata and opsets of a model file."""

    operators: set[tuple[str, str]] = field(default_factory=set)
    """(domain, operator)."""
    metadata: dict[str, str] = field(default_factory=dict)
    opsets: dict[str, int] = field(default_factory=dict)
    external: bool = False
    """A tensor's values lie in another file."""
    functions: bool = False
    """The model brings functions of its own."""


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
        shift += 7
        if shift > 63:
            raise ValueError("a number of more than 64 bits")


def _fields(data: memoryview) -> Iterator[tuple[int, int | memoryview]]:
    """(field number, value) of a protobuf message; a value is a number or the bytes of it."""
    at, end = 0, len(data)
    while at < end:
        key, at = _varint(data, at)
        wire = key & 7
        if wire == 0:
            value, at = _varint(data, at)
            yield key >> 3, value
            continue
        if wire == 2:
            size, at = _varint(data, at)
        elif wire in (1, 5):
            size = 8 if wire == 1 else 4
        else:
            raise ValueError(f"wire type {wire}")
        if at + size > end:
            raise ValueError("a field runs past its message")
        yield key >> 3, data[at : at + size]
        at += size


def _messages(data: memoryview, number: int) -> Iterator[memoryview]:
    for key, value in _fields(data):
        if key == number:
            if isinstance(value, int):
                raise ValueError("a number where a message belongs")
            yield value


def _text(value: int | memoryview) -> str:
    if isinstance(value, int):
        raise ValueError("a number where a text belongs")
    return bytes(value).decode("utf-8")


def _pair(data: memoryview, first: int, second: int) -> tuple[int | memoryview, int | memoryview]:
    found: dict[int, int | memoryview] = {}
    for key, value in _fields(data):
        found[key] = value
    return found.get(first, memoryview(b"")), found.get(second, memoryview(b""))


def _tensor(data: memoryview, out: Contents) -> None:
    for key, value in _fields(data):
        if key == TENSOR_EXTERNAL_DATA or (key == TENSOR_LOCATION and value != 0):
            out.external = True


def _node(data: memoryview, out: Contents, depth: int) -> None:
    operator = domain = ""
    for key, value in _fields(data):
        if key == NODE_OP:
            operator = _text(value)
        elif key == NODE_DOMAIN:
            domain = _text(value)
        elif key == NODE_ATTRIBUTE and not isinstance(value, int):
            for inner, body in _fields(value):
                if isinstance(body, int):
                    continue
                if inner == ATTRIBUTE_TENSOR:
                    _tensor(body, out)
                elif inner in (ATTRIBUTE_GRAPH, ATTRIBUTE_GRAPHS):
                    _graph(body, out, depth + 1)
    out.operators.add((domain, operator))


def _graph(data: memoryview, out: Contents, depth: int) -> None:
    if depth > DEEPEST:
        raise ValueError("graphs nested too deep")
    for key, value in _fields(data):
        if isinstance(value, int):
            continue
        if key == GRAPH_NODE:
            _node(value, out, depth)
        elif key == GRAPH_INITIALIZER:
            _tensor(value, out)


def read(model: bytes) -> Contents:
    """Walk a model file.

    Raises:
        ValueError: it is not a protobuf message of that form.
    """
    out = Contents()
    data = memoryview(model)
    try:
        for key, value in _fields(data):
            if key == MODEL_FUNCTIONS:
                out.functions = True
            if isinstance(value, int):
                continue
            if key == MODEL_GRAPH:
                _graph(value, out, 0)
            elif key == MODEL_OPSET:
                domain, version = _pair(value, 1, 2)
                out.opsets[_text(domain)] = version if isinstance(version, int) else 0
            elif key == MODEL_METADATA:
                name, text = _pair(value, 1, 2)
                out.metadata[_text(name)] = _text(text)
    except IndexError:
        raise ValueError("a number runs past its message") from None
    return out


def check(model: bytes, name: str) -> Contents:
    """Walk a model file and refuse what an exported model never has.

    Raises:
        InputError: one sentence that names the file.
    """
    try:
        contents = read(model)
    except ValueError:
        raise InputError(f"{name}: not an ONNX model; copy or export it again") from None
    if not contents.operators or not contents.opsets:
        raise InputError(f"{name}: not an ONNX model; copy or export it again")
    if contents.external:
        raise InputError(f"{name}: its weights lie in another file; a model must be one file")
    foreign = sorted(
        f"{domain}.{operator}" if domain else operator
        for domain, operator in contents.operators
        if domain not in ("", "ai.onnx") or operator not in OPERATORS
    )
    if foreign or contents.functions:
        what = f"operator {foreign[0]}" if foreign else "functions of its own"
        raise InputError(f"{name}: has {what}, which no exported model uses; export it again")
    return contents
