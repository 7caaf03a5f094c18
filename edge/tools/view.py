"""Show the skin live in a terminal or on a web page.

Draws the skin and, with --model, the events of the last contact. Taxels in contact are red to
white by force, those below the contact threshold grey, and those that cannot be read
blue. Each line shows two rows of taxels, with row 0 at the top. Ctrl-C quits. With
--web, a page for a browser shows the same, with the features of each contact over time.
"""

import argparse
import shutil
import sys
import textwrap
from collections import deque
from collections.abc import Iterable
from contextlib import nullcontext

from edge.classifier import Classifier
from edge.commands.options import add_reading
from edge.commands.source import reading
from edge.commands.texts import event_text
from edge.events import Event, Onset
from edge.model.model import Model
from edge.tools import terminal
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

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
    parser.add_argument("--model", help="model.onnx, to show its decisions too")
    add_reading(parser, " (in place of the terminal)")


def draw(frame: Frame, layout: SkinLayout, events: Iterable[str]) -> str:
    """One picture: the skin, its caption, the texts of events and the legend."""
    full = FULL_FACTOR * max(layout.threshold_counts, 1)
    if layout.counts_per_newton is not None:
        full = round(FULL_NEWTONS * layout.counts_per_newton)
    colour, regions = terminal.skin_colours(frame, layout, full)
    columns = shutil.get_terminal_size().columns
    wide = 2 if 2 * layout.cols <= columns else 1
    texts = [terminal.caption(frame, regions, layout), *events, terminal.LEGEND]
    lines = [line for text in texts for line in textwrap.wrap(text, columns)]
    picture = terminal.picture(colour[:, :columns], wide=wide)
    return "\n".join([picture, *lines])


def run(arguments: argparse.Namespace) -> int:
    """Read at the skin's rate, and draw at `RATE_HZ`."""
    model = None if arguments.model is None else Model(arguments.model)
    texts: deque[str] = deque(maxlen=MOST_EVENTS)
    due = -float("inf")
    with (
        reading(
            arguments,
            model=model,
            real_time=sys.stdout.isatty(),
            decides=model is not None,
        ) as live,
        terminal.drawing() if live.page is None else nullcontext(),
    ):
        classifier = None if model is None else Classifier(model, live.skin.layout)
        layout = live.skin.layout if classifier is None else classifier.layout
        interval_s = 1.0 / RATE_HZ - 0.5 * live.skin.period_s
        for frame, faults in live.frames():
            events = [] if classifier is None else classifier.push(frame)
            live.show(frame, faults, events)
            _follow(events, texts)
            if live.page is None and frame.t >= due:
                due = frame.t + interval_s
                print(
                    terminal.screen(draw(frame, layout, texts)),
                    end="",
                    flush=True,
                )
    return 0


def _follow(events: Iterable[Event], texts: deque[str]) -> None:
    """Add the texts of events; those of a new contact take the place of the former."""
    for event in events:
        if isinstance(event, Onset):
            texts.clear()
        texts.append(event_text(event.to_dict()))
