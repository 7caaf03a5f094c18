"""Show the skin live in a terminal or on a web page.

Draws the skin and, with --model, the latest decisions. Taxels in contact are red to white by force,
those below the contact threshold grey, and those that cannot be read blue. Each line shows two rows
of taxels, with row 0 at the top. q or Ctrl-C quits. With --web, a page for a browser shows the
same, with the features of each contact over time.
"""

from __future__ import annotations

import argparse
import os
import select
import shutil
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from edge.classifier import Classifier
from edge.commands import terminal
from edge.commands.options import add_joints, add_skin, add_web, within
from edge.commands.source import check_joints, ending_signals, open_joints, open_page, open_skin
from edge.errors import printable
from edge.events import Decided, Onset
from edge.model.model import Model
from edge.skin.loop import Loop, Stop, stop_on
from edge.skin.skin import Skin
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import find_regions

RATE_HZ = 10.0
FULL_NEWTONS, FULL_FACTOR = 17.0, 50
"""White is the force above which the paper's lab no longer trusted its readings; if the scale is
unknown, this many times the threshold."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", help="model.onnx, to show its decisions too")
    parser.add_argument(
        "--rate",
        type=within(float, 0.1, 60.0),
        default=RATE_HZ,
        help="pictures per second (default: %(default)s)",
    )
    add_web(parser, " (in place of the terminal)")
    add_skin(parser)
    add_joints(parser)


def draw(frame: Frame, layout: SkinLayout, decisions: dict[str, str]) -> list[str]:
    """The lines of one picture."""
    threshold = layout.threshold_counts
    regions = find_regions(frame.counts, threshold, valid=frame.valid, wraps=layout.wraps)
    scale = layout.counts_per_newton
    full = FULL_FACTOR * max(threshold, 1) if scale is None else round(FULL_NEWTONS * scale)
    colour = terminal.colours(frame, regions, threshold, full)
    columns = shutil.get_terminal_size().columns
    wide = 2 if 2 * layout.cols <= columns else 1
    texts = [terminal.caption(frame, regions, layout)]
    texts += [f"{printable(task)}: {text}" for task, text in decisions.items()]
    return [
        terminal.picture(colour[:, :columns], wide=wide),
        *(line for text in texts for line in textwrap.wrap(text, columns)),
        *terminal.legend(columns),
    ]


@contextmanager
def quit_on_q(stop: Stop) -> Iterator[Callable[[], None]]:
    """A function that sets `stop` if q has been typed at the terminal."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        yield lambda: None
        return
    import termios
    import tty

    fd = sys.stdin.fileno()
    former = termios.tcgetattr(fd)

    def look() -> None:
        while select.select([fd], [], [], 0.0)[0] and not stop.asked:
            stop.asked = os.read(fd, 1) in (b"q", b"Q", b"")

    try:
        tty.setcbreak(fd)
        yield look
    finally:
        with suppress(termios.error):  # the terminal has gone
            termios.tcsetattr(fd, termios.TCSANOW, former)


def decision_text(event: Decided) -> str:
    """A decision as text."""
    text = f"{printable(str(event.label))} ({event.confidence:.0%})"
    return f"{text} [{', '.join(event.flags)}]" if event.flags else text


def run(arguments: argparse.Namespace) -> int:
    """Read at the skin's rate, and draw at the rate that the options ask for."""
    model = None if arguments.model is None else Model(arguments.model)
    chain = None if model is None else model.info.chain
    dof = None if model is None else model.info.dof
    with (
        open_skin(
            arguments, paced=sys.stdout.isatty() or arguments.web is not None, arm=chain
        ) as opened,
        stop_on(*ending_signals()) as stop,
    ):
        if model is not None:
            check_joints(model, arguments, opened)
        with open_joints(arguments, opened, chain, dof) as joints, quit_on_q(stop) as look:
            poses = None if dof is None else joints
            loop = Loop(opened.skin, joints=poses, lasts_s=opened.lasts_s, stop=stop)
            with open_page(arguments, opened, decides=model is not None) as page:
                if page is None:
                    _show(opened.skin, model, loop, 1.0 / arguments.rate, look)
                    return 0
                classifier = None if model is None else Classifier(model, opened.skin.layout)
                for frame in loop.frames():
                    events = () if classifier is None else classifier.push(frame)
                    page.push(frame, events, loop.schedule)
    return 0


def _show(
    skin: Skin, model: Model | None, loop: Loop, interval_s: float, look: Callable[[], None]
) -> None:
    classifier = None if model is None else Classifier(model, skin.layout)
    layout = skin.layout if classifier is None else classifier.layout
    tasks = () if model is None else tuple(model.info.tasks)
    decisions = dict.fromkeys(tasks, "no contact yet")
    due, shown = -float("inf"), ""
    print(terminal.HIDE + terminal.CLEAR, end="")
    try:
        for frame in loop.frames():
            look()
            for event in classifier.push(frame) if classifier is not None else ():
                if isinstance(event, Onset):
                    decisions = dict.fromkeys(tasks, "in contact")
                elif isinstance(event, Decided):
                    decisions[event.task] = decision_text(event)
            if frame.t < due:
                continue
            due = frame.t + interval_s - 0.5 * skin.period_s
            text = terminal.screen(draw(frame, layout, decisions))
            if text != shown:
                print(text, end="", flush=True)
                shown = text
    finally:
        print(terminal.PLAIN + terminal.SHOW, end="", flush=True)
