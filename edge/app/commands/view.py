"""Show the skin live in a terminal or on a web page.

Draws the skin and, with --model, the events of the last contact. Taxels in contact are
red to white by force, those below the contact threshold grey, and those that cannot be
read blue. Each line shows two rows of taxels, with row 0 at the top. Ctrl-C quits. With
--web, a page for a browser shows the same, with the features of each contact over time.
Where NO_COLOR is set, digits show the force.
"""

import argparse
import math
import os
import shutil
import sys
import textwrap
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from itertools import groupby

import numpy as np

from edge.app.options import add_file, add_reading
from edge.app.output import Output
from edge.app.source import Live, reading
from edge.app.texts import event_text
from edge.arrays import Bytes, Floats
from edge.decide.classifier import Classifier
from edge.decide.events import Event, Onset
from edge.decide.model import Model
from edge.errors import InputError, counted
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import Region, find_regions

Colours = Bytes
"""Numbers in the 256-colour palette."""
CLEAR = "\x1b[2J"
HOME = "\x1b[H"
HIDE = "\x1b[?25l"
SHOW = "\x1b[?25h"
PLAIN = "\x1b[0m"
REST = tuple(range(233, 242))
"""256-colour greys by force, for taxels outside every region."""
TOUCH = (88, 124, 160, 196, 202, 208, 214, 220, 226, 228, 231)
"""Dark red to white by force, for the taxels of a region."""
LOST = 18
"""Dark blue, for a taxel that cannot be read."""
LEGEND = (
    "red to white, 1 to B: in contact, by force; grey: below the threshold; blue, ?: "
    "cannot be read; Ctrl-C quits"
)
GLYPHS = {LOST: "?", **dict(zip(TOUCH, "123456789AB", strict=True))}
"""Characters for colours, where the terminal shall have none; others are dots."""
RATE_HZ = 10.0
"""Pictures per second."""
FULL_NEWTONS = 17.0
FULL_FACTOR = 50
"""White is the force above which the paper's lab no longer trusted its readings; if the
scale is unknown, this many times the threshold."""
MOST_EVENTS = 8
"""Events of the last contact that are shown."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_file(parser, "model", "a model, to show its decisions too")
    add_reading(parser, " (in place of the terminal)")


def skin_colours(
    frame: Frame,
    layout: SkinLayout,
    full: int,
) -> tuple[Colours, list[Region]]:
    """256-colour numbers (rows, cols), and the regions.

    The colours show force on a logarithmic scale up to `full` counts.
    """
    threshold = layout.threshold_counts
    regions = find_regions(
        frame.counts,
        threshold,
        valid=frame.valid,
        wraps=layout.wraps,
    )
    counts = frame.counts.astype(np.float64)
    floor = max(threshold, 1)
    colours = _shades(REST, np.log1p(np.minimum(counts, threshold)) / math.log1p(floor))
    span = math.log(max(full, threshold + 2) / floor)
    touched = _shades(TOUCH, np.log(np.maximum(counts, 1.0) / floor) / span)
    for region in regions:
        colours[region.mask] = touched[region.mask]
    if frame.valid is not None:
        colours[~frame.valid] = LOST
    return colours, regions


def _shades(palette: Sequence[int], share: Floats) -> Colours:
    """A palette's colour for each share from 0 to 1; others get the colour of the
    nearer end."""
    steps = np.clip(share, 0.0, 1.0) * (len(palette) - 1)
    shades: Colours = np.array(palette, dtype=np.uint8)[steps.astype(int)]
    return shades


def picture(colour: Colours, *, wide: int = 2) -> str:
    """Lines of half-blocks, with an escape sequence wherever the colour changes.

    Args:
        colour: (rows, cols) numbers in the 256-colour palette.
        wide: characters per taxel.
    """
    if os.environ.get("NO_COLOR"):
        rows = colour.tolist()
        return "\n".join(
            "".join(GLYPHS.get(shade, ".") * wide for shade in row) for row in rows
        )
    lines = []
    for top in range(0, len(colour), 2):
        line = ""
        cells = zip(*colour[top : top + 2].tolist(), strict=True)
        for (upper, *lower), taxels in groupby(cells):
            background = f"48;5;{lower[0]}" if lower else "49"
            blocks = "▀" * wide * len(list(taxels))
            line += f"\x1b[38;5;{upper};{background}m{blocks}"
        lines.append(line + PLAIN)
    return "\n".join(lines)


def caption(frame: Frame, regions: Sequence[Region], layout: SkinLayout) -> str:
    """One line about the largest region and the taxels that cannot be read."""
    items = [f"{frame.t:9.2f} s"]
    for region in regions[:1]:
        scale = layout.counts_per_newton
        force = (
            f"{region.peak} counts" if scale is None else f"{region.peak / scale:.2f} N"
        )
        row, col = region.centroid
        taxels = counted(region.area, "taxel")
        items.append(f"{force} on {taxels} at row {row:.1f}, column {col:.1f}")
    if len(regions) != 1:
        items.append(f"{len(regions) - 1} more" if regions else "no contact")
    if frame.valid is not None and not frame.valid.all():
        items.append(
            f"{int((~frame.valid).sum())} of {frame.valid.size} taxels cannot be read"
        )
    return "  |  ".join(items)


@contextmanager
def drawing() -> Iterator[None]:
    """Within the block, the terminal is clear for pictures and its cursor is hidden."""
    print(HIDE + CLEAR, end="")
    try:
        yield
    finally:
        print(PLAIN + SHOW, end="", flush=True)


def draw(frame: Frame, layout: SkinLayout, events: Iterable[str]) -> str:
    """One picture: the skin, its caption, the texts of events and the legend."""
    full = FULL_FACTOR * max(layout.threshold_counts, 1)
    if layout.counts_per_newton is not None:
        full = round(FULL_NEWTONS * layout.counts_per_newton)
    colour, regions = skin_colours(frame, layout, full)
    columns = shutil.get_terminal_size().columns
    wide = 2 if 2 * layout.cols <= columns else 1
    texts = [caption(frame, regions, layout), *events, LEGEND]
    lines = [line for text in texts for line in textwrap.wrap(text, columns)]
    return "\n".join([picture(colour[:, :columns], wide=wide), *lines])


def run(arguments: argparse.Namespace) -> int:
    """Read at the skin's rate, and draw at `RATE_HZ`.

    Raises:
        InputError: there is nobody to draw for.
    """
    due = math.inf
    if arguments.web is None:
        due = -math.inf
        if Output.of(arguments).as_json:
            raise InputError(
                "view draws for a person: give it a terminal or --web; `edge-classify "
                "run` prints JSON lines"
            )
    model = None if arguments.model is None else Model(arguments.model)
    with (
        reading(
            arguments,
            model=model,
            real_time=sys.stdout.isatty(),
            decides=model is not None,
        ) as live,
        drawing() if live.page is None else nullcontext(),
    ):
        classifier = None if model is None else Classifier(model, live.skin.layout)
        _watch(live, classifier, due)
    return 0


def _watch(live: Live, classifier: Classifier | None, due: float) -> None:
    """Push every frame into the sinks, and draw from a time on."""
    texts: deque[str] = deque(maxlen=MOST_EVENTS)
    layout = live.skin.layout if classifier is None else classifier.layout
    interval_s = 1.0 / RATE_HZ - 0.5 * live.skin.period_s
    for frame, faults in live.frames():
        events = [] if classifier is None else classifier.push(frame)
        for sink in live.sinks:
            sink.push(frame, [*faults, *events])
        _follow(events, texts)
        if frame.t >= due:
            due = frame.t + interval_s
            text = draw(frame, layout, texts) + "\n"
            # Each line clears the rest of its row.
            print(HOME + text.replace("\n", "\x1b[K\n"), end="", flush=True)


def _follow(events: Iterable[Event], texts: deque[str]) -> None:
    """Add the texts of events; those of a new contact take the place of the former."""
    for event in events:
        if isinstance(event, Onset):
            texts.clear()
        texts.append(event_text(event.to_dict()))
