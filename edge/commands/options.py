"""Command-line options that several commands share, and their checks."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from edge.commands.output import LOG
from edge.errors import InputError

if TYPE_CHECKING:
    from edge.model.model import Model
    from edge.touch.arm import Chain

NOISE_COUNTS = 0.7
"""Noise of the fake skins that commands open, below that from which a chip that always
serves the same bytes is stuck: a fake may be calibrated with noise, and then played
without."""


def within(kind: type, low: float, high: float) -> Callable[[str], float]:
    """The type of an option that takes an int or a float from `low` to `high`."""

    def parse(text: str) -> float:
        with suppress(ValueError):
            value: float = kind(text)
            if low <= value <= high:
                return value
        number = "a whole number" if kind is int else "a number"
        raise argparse.ArgumentTypeError(
            f"must be {number} from {low:g} to {high:g}, not {text!r}"
        )

    return parse


seconds = within(float, 1e-3, 1e9)
"""The type of an option that takes a duration."""


def task_label(text: str) -> tuple[str, str]:
    """The type of an option that takes a task and its label, in printable
    characters."""
    task, _, label = (part.strip() for part in text.partition("="))
    if not (task and label and text.isprintable()):
        raise argparse.ArgumentTypeError(
            f"must be TASK=LABEL, such as object=box, not {text!r}"
        )
    return task, label


def add_skin(parser: argparse.ArgumentParser) -> None:
    """Add the options that name the skin, real or fake; `source.open_skin` opens it."""
    parser.add_argument(
        "--skin", metavar="skin.toml", help="the file that describes the skin"
    )
    parser.add_argument(
        "--fake",
        metavar="REC.npz",
        help="need no hardware: play this recording onto fake chips, as fast as "
        "possible; without --skin, the chips are chosen to suit the recording",
    )
    add_noise(parser, "the fake chips of a --skin")
    parser.add_argument(
        "--real-time",
        action="store_true",
        help="play the recording at its original speed",
    )
    parser.add_argument(
        "--loop", action="store_true", help="play the recording over and over"
    )
    parser.add_argument(
        "--seconds",
        type=seconds,
        default=math.inf,
        help="stop after this time (default: never)",
    )


def add_noise(parser: argparse.ArgumentParser, chips: str) -> None:
    """Add the option for the noise of fake chips; its help names them by `chips`."""
    parser.add_argument(
        "--noise",
        type=within(float, 0.0, 1000.0),
        default=NOISE_COUNTS,
        metavar="COUNTS",
        help=f"noise of {chips}, as a standard deviation (default: %(default)g)",
    )


def add_reading(parser: argparse.ArgumentParser, web: str = "") -> None:
    """Add the options of commands that read a skin live; `source.reading` reads it.

    Args:
        parser: of the command.
        web: ends the help of the option for a live page.
    """
    add_skin(parser)
    parser.add_argument(
        "--joints",
        metavar="stdin|udp:[HOST:]PORT",
        help='read joint angles as JSON lines {"t": seconds, "q": [radians]}; add '
        '"names": [joints] if they are not in the arm\'s order; without HOST, the port '
        "listens on the loopback interface",
    )
    parser.add_argument(
        "--web",
        metavar="HOST:PORT",
        nargs="?",
        const="127.0.0.1:8000",
        help="show the skin live on a page for a browser, by default at 127.0.0.1:8000; "
        f"open the link that is printed, with its token{web}",
    )


def add_arm(parser: argparse.ArgumentParser, use: str) -> None:
    """Add `--arm` and, for a URDF, its two links; `open_arm` reads the arm.

    Args:
        parser: of the command.
        use: completes the help "the arm that carries the skin, ...".
    """
    parser.add_argument(
        "--arm",
        metavar="arm.toml|arm.urdf",
        help=f"the arm that carries the skin, {use}",
    )
    parser.add_argument(
        "--base", metavar="LINK", help="in a URDF, the first link of the arm"
    )
    parser.add_argument(
        "--tip", metavar="LINK", help="in a URDF, the link that carries the skin"
    )


def open_arm(arguments: argparse.Namespace) -> Chain | None:
    """The arm that the options name, or None.

    Raises:
        InputError: the file describes no chain of joints, or `--base` and `--tip` do
            not suit it.
    """
    if arguments.arm is not None:
        from edge.touch.arm import Chain

        return Chain.from_file(arguments.arm, arguments.base, arguments.tip)
    if arguments.base is not None or arguments.tip is not None:
        raise InputError("--base and --tip need --arm arm.urdf")
    return None


def add_error(parser: argparse.ArgumentParser) -> None:
    """Add the option that asks for an error rate; `check_error` checks it against the
    model."""
    parser.add_argument(
        "--error",
        type=float,
        metavar="RATE",
        help="decide as early as possible with at most this share of wrong labels (0.1: "
        "one in ten); without it, decide at the end of the window",
    )


def add_engine(parser: argparse.ArgumentParser) -> None:
    """Add the option for the program that runs the model."""
    parser.add_argument(
        "--engine",
        choices=("onnxruntime", "numpy"),
        help="the program that runs the model; both give the same bits (default: "
        "onnxruntime, or numpy where it is not installed)",
    )


def check_error(model: Model, error: float | None) -> None:
    """Log how each task is decided under an error rate; None is not checked.

    Raises:
        InputError: the rate is outside (0, 1), or certified for no task.
    """
    if error is None:
        return
    from edge.early import stopping_rules

    for task, rule in stopping_rules(model, error).items():
        if rule is None:
            LOG.warning(
                f"{task}: decided at the end of the window, as an error of {error:g} "
                f"cannot be certified: {model.info.stopping[task].refusal(error)}"
            )
            continue
        if rule.fixed:
            time = f"always after {model.decision_points_s[rule.last]:g} s"
        else:
            time = f"when sure, in training after {rule.mean_s:.2f} s on average"
        LOG.info(f"{task}: decided {time}; at most {rule.error:.1%} wrong")
