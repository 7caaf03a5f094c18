"""Arrays and their metadata in an `.npz` file, read without pickle."""

import io
import os
import re
import zipfile
from collections.abc import Sequence
from contextlib import nullcontext
from typing import IO, Any, BinaryIO

import numpy as np

from edge.arrays import Array
from edge.config import parse_json, short_text
from edge.errors import InputError
from edge.files import open_regular, parsing

LARGEST_BYTES = 1 << 27
"""Largest size of a file's arrays together. An hour of 384 taxels at 40 Hz takes 111
MB, two minutes of 64 x 62 taxels at 100 Hz take 95."""
TEXT = re.compile(
    rb"\x93NUMPY\x01\0..{'descr': '<U(\d+)', 'fortran_order': False, 'shape': \(\), } *\n",
    re.DOTALL,
)
"""The head of a `.npy` file that holds a text."""


def load_arrays(
    path: str | os.PathLike[str],
    file: BinaryIO | None = None,
    keys: Sequence[str] | None = None,
    allowed: Sequence[str] = (),
) -> dict[str, Array]:
    """Arrays of an `.npz`, read without pickle.

    An array is filled from the file piece by piece, so a header that claims more than
    the file holds takes no memory.

    Args:
        path: of the file, for errors.
        file: its contents, if they have been read already.
        keys: names of arrays; those that the file has are read. None reads all.
        allowed: names of the parts that the file may have; any where there are none.

    Raises:
        InputError: the file is missing, damaged, larger than `LARGEST_BYTES`, or holds
            something other than plain arrays, or a part that is not allowed.
    """
    name = os.fspath(path)
    opened = open_regular(name, LARGEST_BYTES) if file is None else nullcontext(file)
    with (
        opened as contents,
        parsing(name, "a readable .npz file", "; copy or record it again"),
        zipfile.ZipFile(contents) as archive,
    ):
        if allowed:
            _check_parts(name, archive.namelist(), allowed)
        members = _members(archive, keys)
        if sum(info.file_size for info in members.values()) > LARGEST_BYTES:
            raise InputError(
                f"{name}: claims arrays of more than {LARGEST_BYTES} bytes; split it"
            )
        arrays = {}
        for key, info in members.items():
            with archive.open(info) as stream:
                arrays[key] = _text(stream.read()) if key == "meta" else _array(stream)
    return arrays


def _members(
    archive: zipfile.ZipFile, keys: Sequence[str] | None
) -> dict[str, zipfile.ZipInfo]:
    """{key: the part that holds its array}, of some keys or of all."""
    members = {}
    for info in archive.infolist():
        key = info.filename.removesuffix(".npy")
        if key != info.filename and (keys is None or key in keys):
            members[key] = info
    return members


def _check_parts(name: str, files: Sequence[str], allowed: Sequence[str]) -> None:
    """Refuse a file with a part that is not known, or there twice: its name is damaged,
    and what it holds would be lost in silence."""
    for file in files:
        if file not in allowed or files.count(file) > 1:
            raise InputError(
                f"{name}: has a part {short_text(file)}, which no recording has, or has "
                "twice; copy or record it again"
            )


def _text(contents: bytes) -> Array:
    """The array in a `.npy` file, which usually is a text: numpy takes longer to read
    such a header than all else of a recording's labels takes."""
    head = TEXT.match(contents)
    text = contents[head.end() :].decode("utf-32-le") if head else ""
    if head is None or len(text) != int(head[1]):
        return _array(io.BytesIO(contents))
    return np.array(text)


def _array(stream: IO[bytes]) -> Array:
    """The array in a `.npy` file."""
    array: Array = np.lib.format.read_array(stream, allow_pickle=False)
    return array


def load_meta(name: str, arrays: dict[str, Array]) -> dict[str, Any]:
    """The JSON object under `meta`."""
    raw = arrays.get("meta")
    if raw is None:
        raise InputError(
            f"{name}: meta is missing; store a JSON object as text under it"
        )
    if raw.dtype.kind != "U" or raw.size != 1:
        raise InputError(
            f"{name}: meta must be one JSON text, not {raw.dtype} {raw.shape}"
        )
    meta = parse_json(raw.item(), f"{name}: meta")
    if not isinstance(meta, dict):
        raise InputError(f"{name}: meta must be a JSON object, not {short_text(meta)}")
    return meta
