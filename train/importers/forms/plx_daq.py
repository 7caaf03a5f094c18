"""Logs of an Arduino for PLX-DAQ: commands, `LABEL,` with names, `DATA,` with values."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

from train.importers.forms.file import File
from train.importers.forms.text import table_of
from train.importers.options import TableOptions
from train.importers.table import Table

STANDS_IN = {"DATE", "TIME", "TIMER"}
"""What PLX-DAQ replaces by the computer's clock."""


def is_form(file: File) -> bool:
    """Whether lines begin with commands of PLX-DAQ."""
    return bool(re.search(r"^DATA,", file.head, re.M | re.I)) and bool(
        re.search(r"^(?:CLEARDATA|CLEARSHEET|LABEL,)", file.head, re.M | re.I)
    )


def tables(file: File, options: TableOptions) -> Iterator[Table]:
    """The values after each CLEARDATA, without columns of the computer's clock."""
    label, filled = _blocks(file.lines)
    for number, block in enumerate(filled, 1):
        table = table_of(str(file.path), [label, *block])
        clocks = [
            name
            for name in table.names
            if set(table.data[name].astype(str).str.upper()) <= STANDS_IN
        ]
        name = f"{file.path.stem}_{number:03}" if len(filled) > 1 else ""
        yield replace(table, data=table.data.drop(columns=clocks), name=name)


def _blocks(lines: Sequence[str]) -> tuple[str, list[list[str]]]:
    """The last line of names, and the lines of values after each CLEARDATA; lines of
    other commands are empty."""
    blocks: list[list[str]] = [[]]
    label = ""
    for line in lines:
        text = re.sub(r",AUTOSCROLL_\d+$", "", line.strip())
        command, _, cells = text.partition(",")
        command = command.upper()
        if command in ("CLEARDATA", "CLEARSHEET"):
            blocks.append([])
        blocks[-1].append(cells if command == "DATA" else "")
        label = cells if command == "LABEL" else label
    return label, [block for block in blocks if any(block)]
