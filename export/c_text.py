"""Values as text of C, and files of C that take them."""

from __future__ import annotations

import string
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from edge.writing import write_whole


def write_rooms(
    rooms: Path,
    folder: Path,
    values: Mapping[str, str],
    more: Mapping[str, bytes] | None = None,
) -> None:
    """Write all files of C of a folder with these values, and more, whole or not at
    all."""
    contents = {
        room.name: string.Template(room.read_text()).substitute(values).encode()
        for room in rooms.glob("*.[ch]")
    }
    with ExitStack() as files:
        for name, data in (contents | dict(more or {})).items():
            file = files.enter_context(write_whole(folder / name))
            file.write(data)
            file.flush()


def literal(value: object) -> str:
    """A value in C: hexadecimal floats hold every bit."""
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return f"{{{', '.join(map(literal, value)) or '0'}}}"
    if not isinstance(value, float | np.floating):
        number = int(value)  # type: ignore[call-overload]
        return f"{number}u" if number > 2**31 else str(number)
    if np.isnan(value):
        return "(double)NAN"
    if np.isinf(value):
        return f"{'-' if value < 0.0 else ''}(double)INFINITY"
    return float(value).hex()


def array(kind: str, values: Iterable[object]) -> str:
    """A constant array without a name."""
    return f"(const {kind}[]){literal(values)}"
