"""`edge-classify view`: shows the skin live in a terminal."""

from __future__ import annotations

import argparse
import os
import select
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TextIO

from edge.classifier import Classifier
from edge.commands import terminal
from edge.commands.options import add_joints, add_skin
from edge.commands.source import check_joints, open_joints, open_skin
from edge.errors import InputError, printable
from edge.events import Decided, Onset
from edge.model.model import Model
from edge.skin.loop import STOP_S, Loop, Stop, stop_on
from edge.skin.skin import Skin
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.region import find_regions

RATE_HZ = 10.0
FULL_NEWTONS, FULL_FACTOR = 17.0, 50
"""White stands for the force above which the lab no longer trusted its readings; where the scale
is unknown, for this many times the threshold."""


HELP = "show the skin live in a terminal"
DESCRIPTION = (
    "Draws the skin and, with --model, the latest decisions. Taxels in contact "
    "are red to white by force, those below the contact threshold grey, and those that "
    "cannot be read blue. Each line shows two rows of taxels; row 0 is at the top. "
    "q or Ctrl-C ends it."
)


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("--model", help="model.onnx, to show its decisions too")
    parser.add_argument(
        "--rate", type=float, default=RATE_HZ, help="pictures a second (default: %(default)s)"
    )
    add_skin(parser)
    add_joints(parser)


def draw(frame: Frame, layout: SkinLayout, decisions: dict[str, str]) -> list[str]:
    """The lines of one picture."""
    threshold = layout.threshold_counts
    regions = find_regions(frame.counts, threshold, valid=frame.valid, wraps=layout.wraps)
    scale = layout.counts_per_newton
    full = FULL_FACTOR * max(threshold, 1) if scale is None else round(FULL_NEWTONS * scale)
    colour = terminal.colours(frame, regions, threshold, full)
    said = [f"{printable(task)}: {text}" for task, text in decisions.items()]
    columns = shutil.get_terminal_size().columns
    wide = 2 if 2 * layout.cols <= columns else 1
    return [
        terminal.picture(colour[:, :columns], wide=wide),
        *terminal.wrapped(terminal.caption(frame, regions, layout), columns),
        *(line for text in said for line in terminal.wrapped(text, columns)),
        *terminal.legend(columns),
    ]


@contextmanager
def quit_on_q(stop: Stop) -> Iterator[Callable[[], None]]:
    """A function that asks the loop to stop once `q` was typed at the terminal."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        yield lambda: None
        return
    import termios
    import tty

    fd = sys.stdin.fileno()
    before = termios.tcgetattr(fd)

    def look() -> None:
        while select.select([fd], [], [], 0.0)[0] and not stop.asked:
            stop.asked = os.read(fd, 1) in (b"q", b"Q", b"")

    try:
        tty.setcbreak(fd)
        yield look
    finally:
        termios.tcsetattr(fd, termios.TCSANOW, before)  # a terminal that is stopped drains nothing


def sender(out: TextIO, stop: Stop) -> Callable[[str], None]:
    """Writes a text to the terminal, or gives it up once `stop` is asked for and nobody reads.

    A write that waits for a reader would not hear of it.
    """
    try:
        out.flush()
        fd = out.fileno()
    except (OSError, ValueError):  # no file behind it
        return lambda text: print(text, end="", file=out, flush=True)

    def send(text: str) -> None:
        data = text.encode(out.encoding, out.errors or "strict")
        while data:
            if select.select([], [fd], [], 0.0 if stop.asked else STOP_S)[1]:
                data = data[os.write(fd, data[: select.PIPE_BUF]) :]
            elif stop.asked:
                return

    return send


def spoken(event: Decided) -> str:
    """A decision as text."""
    text = f"{printable(str(event.label))} ({event.confidence:.0%})"
    return f"{text} [{', '.join(event.flags)}]" if event.flags else text


def run(arguments: argparse.Namespace) -> int:
    """Read at the skin's rate, and draw at the rate that the options ask for."""
    if not 0.1 <= arguments.rate <= 60.0:
        raise InputError(f"--rate must be 0.1 to 60 pictures a second, not {arguments.rate:g}")
    model = None if arguments.model is None else Model(arguments.model)
    chain = None if model is None else model.info.chain
    dof = None if model is None else model.info.dof
    with (
        open_skin(arguments, paced=sys.stdout.isatty(), arm=chain) as opened,
        stop_on(signal.SIGINT, signal.SIGTERM) as stop,
    ):
        if model is not None:
            check_joints(model, arguments, opened)
        with open_joints(arguments, opened, chain, dof) as joints, quit_on_q(stop) as look:
            loop = Loop(
                opened.skin,
                joints=joints if dof is not None else None,
                lasts_s=opened.lasts_s,
                stop=stop,
            )
            _show(arguments, opened.skin, model, loop, look, sender(sys.stdout, stop))
    return 0


def _show(
    arguments: argparse.Namespace,
    skin: Skin,
    model: Model | None,
    loop: Loop,
    look: Callable[[], None],
    send: Callable[[str], None],
) -> None:
    classifier = None if model is None else Classifier(model, skin.layout)
    layout = skin.layout if classifier is None else classifier.layout
    tasks = () if model is None else tuple(model.info.tasks)
    decisions = dict.fromkeys(tasks, "no contact yet")
    due, before = -float("inf"), ""
    send(terminal.HIDE + terminal.CLEAR)
    try:
        for frame in loop.frames():
            look()
            for event in classifier.push(frame) if classifier is not None else ():
                if isinstance(event, Onset):
                    decisions = dict.fromkeys(tasks, "in contact")
                elif isinstance(event, Decided):
                    decisions[event.task] = spoken(event)
            if frame.t < due:
                continue
            due = frame.t + 1.0 / arguments.rate - 0.5 * skin.period_s
            text = terminal.screen(draw(frame, layout, decisions))
            if text != before:
                send(text)
                before = text
    finally:
        send(terminal.PLAIN + terminal.SHOW)
