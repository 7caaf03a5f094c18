"""An uncompressed `.npz` as the pieces that make it up: the arrays themselves, not copies of them.

`numpy.savez` copies each array and writes in many small steps, which takes several times as long.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Mapping
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.lib.format import dtype_to_descr, write_array_header_1_0
from numpy.typing import NDArray

LARGEST_BYTES = 1 << 31
"""Of the arrays together: a plain ZIP file counts its bytes in 32 bits."""
FIRST_DAY = 33
"""1 January 1980 as ZIP writes it, so that the same arrays give the same bytes at any time."""


def pieces(arrays: Mapping[str, NDArray[Any]]) -> list[bytes | memoryview]:
    """What to write, one after the other: for each array its entry, then the directory of all."""
    out: list[bytes | memoryview] = []
    directory, at = b"", 0
    for key, array in arrays.items():
        array = np.asarray(array, order="C")
        header, data = _header(array.dtype, array.shape), array.reshape(-1).view(np.uint8).data
        name, size = f"{key}.npy".encode(), len(header) + len(data)
        # The version of ZIP that reads it, no flags, neither packed nor at any hour of its day.
        fields = struct.pack("<5HL", 20, 0, 0, 0, FIRST_DAY, zlib.crc32(data, zlib.crc32(header)))
        fields += struct.pack("<2L2H", size, size, len(name), 0)
        directory += b"PK\x01\x02" + struct.pack("<H", 20) + fields
        directory += struct.pack("<3H2L", 0, 0, 0, 0, at) + name
        out += [b"PK\x03\x04" + fields + name + header, data]
        at += len(out[-2]) + len(data)
    count, size = len(arrays), len(directory)
    end = b"PK\x05\x06" + struct.pack("<4H2LH", 0, 0, count, count, size, at, 0)
    return [*out, directory + end]


@lru_cache(maxsize=64)
def _header(dtype: np.dtype[Any], shape: tuple[int, ...]) -> bytes:
    """What stands before an array's numbers; recordings of a kind have the same."""
    described = {"descr": dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    write_array_header_1_0(npy := io.BytesIO(), described)
    return npy.getvalue()
