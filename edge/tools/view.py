"""Show the skin live in a terminal or on a web page.

Draws the skin and, with --model, the latest decisions. Taxels in contact are red to
white by force, those below the contact threshold grey, and those that cannot be read
blue. Each line shows two rows of taxels, with row 0 at the top. Ctrl-C quits. With
--web, a page for a browser shows the same, with the features of each contact over time.
"""

import argparse
import shutil
import sys
import textwrap
from collections.abc import Iterable
from contextlib import nullcontext

from edge.classifier import Classifier
from edge.commands.options import add_reading
from edge.commands.source import reading
from edge.errors import printable
from edge.events import Decided, Event, Onset
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


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", help="model.onnx, to show its decisions too")
    add_reading(parser, " (in place of the terminal)")


def draw(frame: Frame, layout: SkinLayout, decisions: dict[str, str]) -> str:
    """One picture: the skin, its caption, the decisions and the legend."""
    full = FULL_FACTOR * max(layout.threshold_counts, 1)
    if layout.counts_per_newton is not None:
        full = round(FULL_NEWTONS * layout.counts_per_newton)
    colour, regions = terminal.skin_colours(frame, layout, full)
    columns = shutil.get_terminal_size().columns
    wide = 2 if 2 * layout.cols <= columns else 1
    texts = [terminal.caption(frame, regions, layout)]
    texts += [f"{printable(task)}: {text}" for task, text in decisions.items()]
    lines = [line for text in texts for line in textwrap.wrap(text, columns)]
    picture = terminal.picture(colour[:, :columns], wide=wide)
    return "\n".join([picture, *lines, *terminal.legend(columns)])


def decision_text(event: Decided) -> str:
    """A decision as text."""
    text = printable(str(event.label))
    if event.confidence is not None:
        text += f" ({event.confidence:.0%})"
    return f"{text} [{', '.join(event.flags)}]" if event.flags else text


def run(arguments: argparse.Namespace) -> int:
    """Read at the skin's rate, and draw at `RATE_HZ`."""
    model = None if arguments.model is None else Model(arguments.model)
    tasks = () if model is None else tuple(model.info.tasks)
    decisions = dict.fromkeys(tasks, "no contact yet")
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
            _follow(events, decisions)
            if live.page is None and frame.t >= due:
                due = frame.t + interval_s
                print(
                    terminal.screen(draw(frame, layout, decisions)),
                    end="",
                    flush=True,
                )
    return 0


def _follow(events: Iterable[Event], decisions: dict[str, str]) -> None:
    """Show events in {task: the text of its decision}."""
    for event in events:
        if isinstance(event, Onset):
            decisions.update(dict.fromkeys(decisions, "in contact"))
        elif isinstance(event, Decided):
            decisions[event.task] = decision_text(event)
