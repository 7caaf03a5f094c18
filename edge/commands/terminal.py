"""The skin drawn with ANSI half-blocks, two rows of taxels per line."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import Region

CLEAR, HOME, HIDE, SHOW, PLAIN = "\x1b[2J", "\x1b[H", "\x1b[?25l", "\x1b[?25h", "\x1b[0m"
REST = tuple(range(233, 242))
"""256-colour greys for taxels outside every region, by force."""
TOUCH = (88, 124, 160, 196, 202, 208, 214, 220, 226, 228, 231)
"""Dark red to white for the taxels of a region, by force."""
LOST = 18
"""Dark blue for a taxel that cannot be read."""


def colours(
    frame: Frame, regions: Sequence[Region], threshold: int, full: int
) -> NDArray[np.uint8]:
    """256-colour numbers (rows, cols), by force on a logarithmic scale up to `full` counts."""
    counts = frame.counts.astype(np.float64)
    rest = np.log1p(np.minimum(counts, threshold)) / math.log1p(max(threshold, 1))
    out: NDArray[np.uint8] = np.array(REST, dtype=np.uint8)[(rest * (len(REST) - 1)).astype(int)]
    span = math.log(max(full, threshold + 2) / max(threshold, 1))
    above = np.log(np.maximum(counts, 1.0) / max(threshold, 1)) / span
    hot = np.array(TOUCH, dtype=np.uint8)[
        (np.minimum(np.maximum(above, 0.0), 1.0) * (len(TOUCH) - 1)).astype(int)
    ]
    for region in regions:
        out[region.mask] = hot[region.mask]
    if frame.valid is not None:
        out[~frame.valid] = LOST
    return out


def picture(colour: NDArray[np.uint8], *, wide: int = 2) -> str:
    """Lines of half-blocks; an escape sequence is written only where the colour changes.


    Args:
        colour: (rows, cols) numbers in the 256-colour palette.
        wide: characters per taxel.
    """
    lines = []
    rows = colour.shape[0]
    for top in range(0, rows, 2):
        upper = colour[top].tolist()
        lower = colour[top + 1].tolist() if top + 1 < rows else [None] * len(upper)
        line, before = [], (-1, -1)
        for pair in zip(upper, lower, strict=True):
            if pair != before:
                back = "49" if pair[1] is None else f"48;5;{pair[1]}"
                line.append(f"\x1b[38;5;{pair[0]};{back}m")
                before = pair
            line.append("▀" * wide)
        lines.append("".join(line) + PLAIN)
    return "\n".join(lines)


def caption(frame: Frame, regions: Sequence[Region], layout: SkinLayout) -> str:
    """One line about the largest region and about taxels that cannot be read."""
    parts = [f"{frame.t:9.2f} s"]
    if regions:
        region = regions[0]
        scale = layout.counts_per_newton
        force = f"{region.peak} counts" if scale is None else f"{region.peak / scale:.2f} N"
        row, col = region.centroid
        parts.append(f"{force} on {region.area} taxels at row {row:.1f}, column {col:.1f}")
        if len(regions) > 1:
            parts.append(f"{len(regions) - 1} more")
    else:
        parts.append("no contact")
    if frame.valid is not None and not frame.valid.all():
        parts.append(f"{int((~frame.valid).sum())} taxels cannot be read")
    return "  |  ".join(parts)


def wrapped(text: str, columns: int) -> list[str]:
    """A caption in lines of at most so many columns, broken between its parts where it can be."""
    lines: list[str] = []
    for part in text.split("  |  "):
        if lines and len(lines[-1]) + 5 + len(part) <= columns:
            lines[-1] += f"  |  {part}"
        else:
            lines += textwrap.wrap(part, columns) or [""]
    return lines


def legend(columns: int) -> list[str]:
    """What the colours stand for."""
    entries = [
        ("".join(f"\x1b[38;5;{colour}m■" for colour in TOUCH[2::3]), 3, "touched, by force"),
        (f"\x1b[38;5;{REST[-1]}m■", 1, "below the threshold"),
        (f"\x1b[38;5;{LOST}m■", 1, "cannot be read"),
        ("q", 1, "quits"),
    ]
    lines, width = [""], 0
    for mark, marks, text in entries:
        size = marks + 1 + len(text)
        if width and width + 3 + size > columns:
            lines, width = [*lines, ""], 0
        gap = "   " if width else ""
        lines[-1] += f"{gap}{mark}{PLAIN} {text}"
        width += len(gap) + size
    return lines


def screen(lines: Sequence[str]) -> str:
    """Lines from the upper left corner on, each clearing what was there before."""
    return HOME + "".join(f"{line}\x1b[K\n" for line in "\n".join(lines).split("\n"))
