"""Logs of a serial monitor: `12:00:00.123 -> ` before each line, or `name:value` in each
cell, as the serial plotter of Arduino takes it."""

import re
from collections.abc import Iterator

from train.importers.forms.file import File
from train.importers.forms.text import table_of
from train.importers.options import TableOptions
from train.importers.table import Table

STAMP = re.compile(r"(\d\d:\d\d:\d\d\.\d+) -> ")
PAIR = re.compile(r"([^\W\d][\w ]{0,60}?)\s{0,8}[:=]\s{0,8}([-+]?[\d.]+)(?=[\s,;]|\Z)")
"""A name and its value. Longer names would take the square of a line's length."""


def is_form(file: File) -> bool:
    """Whether the first lines have stamps, or consist of pairs."""
    lines = file.head.split("\n")
    odd = [line for line in lines if not (STAMP.match(line) or len(_names(line)) > 1)]
    return len(odd) <= 1 < len(lines) - len(odd)


def _names(line: str) -> list[str]:
    """The names of the pairs that a line consists of."""
    pairs = PAIR.findall(line)
    return [] if PAIR.sub("", line).strip(" \t,;") else [name for name, _ in pairs]


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The values, with the time of the stamps."""
    lines = []
    heads = []
    for line in file.lines:
        stamp = STAMP.match(line)
        values = STAMP.sub("", line)
        names = _names(values)
        if names:
            values = "\t".join(value for _, value in PAIR.findall(values))
        mark = next((mark for mark in "\t;," if mark in values), "\t")
        lines.append(f"{stamp[1]}{mark}{values}" if stamp else values)
        heads.append("\t".join(["time"] * bool(stamp) + names) if names else "")
    head = max(heads, key=len)
    yield table_of(str(file.path), [head, *lines] if head else lines)
