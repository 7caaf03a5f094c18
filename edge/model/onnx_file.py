"""What a model file holds, read before ONNX Runtime is trusted with it.

The few fields of the ONNX protobuf (onnx.proto3) that show whether a file refers to nothing outside
itself and uses only the operators that an exported model has: ONNX Runtime would follow a path to
another file, and run any operator that it knows.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

from edge.errors import InputError

OPERATORS = frozenset(
    "Add And ArgMax Cast Concat CumSum Div Gather GatherElements Identity If Less LessOrEqual "
    "MatMul Mul Not Pad ReduceMax ReduceMin ReduceSum ReduceSumSquare Slice Sqrt Squeeze Sub TopK "
    "Unsqueeze Where".split()
)
"""The operators, all of the standard domain, that an exported model may use."""

GRAPH, OPSETS, METADATA, FUNCTIONS = 7, 8, 14, 25
"""Fields of a ModelProto."""
NODES, INITIALIZERS = 1, 5
OPERATOR, ATTRIBUTES, DOMAIN = 4, 5, 7
TENSORS_OF_AN_ATTRIBUTE, GRAPHS_OF_AN_ATTRIBUTE = (5, 10), (6, 11)
EXTERNAL_DATA, DATA_LOCATION = 13, 14
DEEPEST = 8

Message = dict[int, list[int | memoryview]]
"""{field number: its values}: a number, or the bytes of a text or of a message within."""


@dataclass
class Contents:
    """Operators, metadata and opsets of a model file."""

    operators: set[tuple[str, str]] = field(default_factory=set)
    """(domain, operator)."""
    metadata: dict[str, str] = field(default_factory=dict)
    opsets: dict[str, int | memoryview] = field(default_factory=dict)
    """{domain: version}."""
    external: bool = False
    """A tensor's values lie in another file."""
    functions: bool = False
    """The model brings functions of its own."""


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        if byte < 0x80:
            return value, at
    raise ValueError("a number of more than 64 bits")


def _message(value: int | memoryview) -> Message:
    """The fields of a protobuf message (protobuf.dev, Encoding)."""
    if isinstance(value, int):
        raise ValueError("a number where a message belongs")
    fields: Message = defaultdict(list)
    at = 0
    while at < len(value):
        key, at = _varint(value, at)
        size = {1: 8, 5: 4}.get(key & 7)
        if key & 7 == 0:
            number, at = _varint(value, at)
            fields[key >> 3].append(number)
            continue
        if key & 7 == 2:
            size, at = _varint(value, at)
        if size is None or at + size > len(value):
            raise ValueError("a field of no known kind, or one that runs past its message")
        fields[key >> 3].append(value[at : at + size])
        at += size
    return fields


def _text(message: Message, number: int) -> str:
    """The last of a field's values, as protobuf takes them; empty where there is none."""
    values = message.get(number, [b""])
    if isinstance(values[-1], int):
        raise ValueError("a number where a text belongs")
    return bytes(values[-1]).decode("utf-8")


def _graph(value: int | memoryview, out: Contents, depth: int) -> None:
    if depth > DEEPEST:
        raise ValueError("graphs nested too deep")
    graph = _message(value)
    tensors = list(graph.get(INITIALIZERS, ()))
    for node in map(_message, graph.get(NODES, ())):
        out.operators.add((_text(node, DOMAIN), _text(node, OPERATOR)))
        for attribute in map(_message, node.get(ATTRIBUTES, ())):
            for number in TENSORS_OF_AN_ATTRIBUTE:
                tensors += attribute.get(number, ())
            for number in GRAPHS_OF_AN_ATTRIBUTE:
                for inner in attribute.get(number, ()):
                    _graph(inner, out, depth + 1)
    for tensor in map(_message, tensors):
        out.external |= EXTERNAL_DATA in tensor or any(tensor.get(DATA_LOCATION, ()))


def read(data: bytes) -> Contents:
    """Walk a model file.

    Raises:
        ValueError: it is not a protobuf message of that form.
    """
    out = Contents()
    try:
        model = _message(memoryview(data))
        out.functions = FUNCTIONS in model
        for opset in map(_message, model.get(OPSETS, ())):
            out.opsets[_text(opset, 1)] = opset.get(2, [0])[-1]
        for entry in map(_message, model.get(METADATA, ())):
            out.metadata[_text(entry, 1)] = _text(entry, 2)
        for graph in model.get(GRAPH, ()):
            _graph(graph, out, 0)
    except IndexError:
        raise ValueError("a number runs past its message") from None
    return out


def check(data: bytes, name: str) -> Contents:
    """Walk a model file and refuse what an exported model never has.

    Raises:
        InputError: one sentence that names the file.
    """
    try:
        contents = read(data)
    except ValueError:
        contents = Contents()
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
