"""A model file with other constants and other metadata."""

from collections.abc import Iterator, Mapping

import numpy as np

from edge.arrays import Array
from edge.model.graph import TYPES
from edge.model.onnx_file import (
    GRAPH,
    INITIALIZERS,
    METADATA,
    TENSOR_NAME,
    fields_of,
    message_of,
    text_of,
)


def rewritten(
    data: bytes,
    constants: Mapping[str, Array],
    metadata: Mapping[str, str],
) -> bytes:
    """A model's bytes with other values of some constants, and other metadata."""
    model: list[bytes | memoryview] = []
    for number, value, unchanged in fields_of(memoryview(data)):
        if number == GRAPH:
            model.append(_field(GRAPH, b"".join(_constants_changed(value, constants))))
            continue
        key = text_of(message_of(value), 1) if number == METADATA else ""
        if key in metadata:
            entry = _field(1, key.encode()) + _field(2, metadata[key].encode())
            model.append(_field(METADATA, entry))
        else:
            model.append(unchanged)
    return b"".join(model)


def _constants_changed(
    graph: memoryview, constants: Mapping[str, Array]
) -> Iterator[bytes | memoryview]:
    kinds = {np.dtype(kind): number for number, kind in TYPES.items()}
    for number, value, unchanged in fields_of(graph):
        initializer = number == INITIALIZERS
        name = text_of(message_of(value), TENSOR_NAME) if initializer else ""
        if name in constants:
            array = np.ascontiguousarray(constants[name])
            tensor = [_field(1, size) for size in array.shape]
            tensor.append(_field(2, kinds[array.dtype]))
            tensor.append(_field(TENSOR_NAME, name.encode()))
            tensor.append(_field(9, array.tobytes()))
            yield _field(INITIALIZERS, b"".join(tensor))
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
