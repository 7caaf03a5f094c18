"""Show which chips answer, as a map of the skin.

Sets up every chip, and prints each chip's state and a map of the skin: # is a taxel whose chip
answers, . one whose chip does not, and a blank one without a chip. The exit status is 1 if a chip
does not answer.
"""

from __future__ import annotations

import argparse

import numpy as np

from edge.commands.options import add_skin
from edge.commands.output import Output
from edge.commands.source import chip_event, open_skin
from edge.i2c.chip import UNUSED
from edge.skin.file import SkinFile
from edge.skin.skin import ChipStatus


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_skin(parser)


def skin_map(file: SkinFile, statuses: list[ChipStatus]) -> str:
    """One line per row: `#` if a taxel's chip answers, `.` if not, blank without a chip."""
    marks = np.full(file.layout.rows * file.layout.cols, " ")
    for status in statuses:
        for taxel in status.taxels:
            if taxel != UNUSED:
                marks[taxel] = "#" if status.state == "running" else "."
    rows = marks.reshape(file.layout.shape).tolist()
    return "\n".join(f"{i:3} |{''.join(row)}|" for i, row in enumerate(rows))


def run(arguments: argparse.Namespace) -> int:
    """Print each chip and the map; 1 if a chip does not answer."""
    output = Output.of(arguments)
    with open_skin(arguments, calibrated=False) as opened:
        statuses = opened.skin.status()
        for status in statuses:
            if output.as_json or status.state != "running":
                text = f"{status.kind}: {status.error or status.state}"
                output.event(chip_event(status, kind=status.kind), text)
        output.text(skin_map(opened.skin.file, statuses))
    missing = sum(status.state != "running" for status in statuses)
    output.text(f"{len(statuses) - missing} of {len(statuses)} chips answer")
    return 1 if missing else 0
