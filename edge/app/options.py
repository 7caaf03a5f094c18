"""Command-line options that several commands share, and their checks."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from edge.errors import InputError
from edge.touch.arm import Chain, read_arm

if TYPE_CHECKING:
    from edge.decide.model import Model


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


def add_file(
    parser: argparse.ArgumentParser, name: str, text: str, *, needed: bool = False
) -> None:
    """Add the option for a model or a skin, which `edge.app.cli.dispatch` takes as a bare
    word too."""
    suffix = {"model": "onnx", "skin": "toml"}[name]
    help = f"{text}; may stand without --{name}"
    parser.add_argument(f"--{name}", metavar=f"{name}.{suffix}", help=help)
    if needed:
        parser.set_defaults(needs=name)


def apart(words: list[str], *named: str | None) -> tuple[list[str], list[str]]:
    """The models that options name or that stand among bare words, by their suffix, and
    the other words."""
    bare = [word for word in words if word.endswith(".onnx")]
    others = [word for word in words if word not in bare]
    return [*filter(None, named), *bare], others


def add_skin(parser: argparse.ArgumentParser) -> None:
    """Add the options that name the skin, real or fake; `source.open_skin` opens it."""
    add_file(parser, "skin", "the file that describes the skin")
    parser.add_argument(
        "--fake",
        metavar="REC.npz",
        help="recording to play onto fake chips, as fast as possible, in place of "
        "hardware; without --skin, the chips are chosen to suit it",
    )
    parser.add_argument(
        "--loop",
        action="store_true",
        help="endless repetition of the recording",
    )


def add_reading(parser: argparse.ArgumentParser, web: str = "") -> None:
    """Add the options of commands that read a skin live; `source.reading` reads it.

    Args:
        parser: of the command.
        web: ends the help of the option for a live page.
    """
    add_skin(parser)
    parser.add_argument(
        "--seconds",
        type=seconds,
        default=math.inf,
        help="time after which to stop (default: never)",
    )
    parser.add_argument(
        "--joints",
        metavar="stdin|udp:[HOST:]PORT",
        help='joint angles as JSON lines {"t": seconds, "q": [radians]}; add '
        '"names": [joints] if they are not in the arm\'s order; without HOST, the port '
        'listens on the loopback interface; a line {"onset": true} begins a touch, for a '
        "model whose onsets come from outside",
    )
    parser.add_argument(
        "--web",
        metavar="HOST:PORT",
        nargs="?",
        const="127.0.0.1:8000",
        help="live page of the skin for a browser, by default at 127.0.0.1:8000; "
        f"open the link that is printed, with its token{web}",
    )


def add_error(parser: argparse.ArgumentParser) -> None:
    """Add the option that asks for an error rate; `check_error` checks it against the
    model."""
    parser.add_argument(
        "--error",
        type=float,
        metavar="RATE",
        help="greatest share of wrong labels (0.1: one in ten), with which each decision "
        "comes as early as possible; without it, at the end of the window",
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
    if error is not None:
        from edge.decide.early import log_rules  # few runs decide early

        log_rules(model, error)


def task_label(text: str) -> tuple[str, str]:
    """The type of an option that takes a task and its label, in printable
    characters."""
    task, _, label = (part.strip() for part in text.partition("="))
    if not (task and label and text.isprintable()):
        raise argparse.ArgumentTypeError(
            f"must be TASK=LABEL, such as object=box, not {text!r}"
        )
    return task, label


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
        "--base",
        metavar="LINK",
        help="first link of the arm, in a URDF",
    )
    parser.add_argument(
        "--tip",
        metavar="LINK",
        help="link that carries the skin, in a URDF",
    )


def open_arm(arguments: argparse.Namespace) -> Chain | None:
    """The arm that the options name, or None.

    Raises:
        InputError: the file describes no chain of joints, or `--base` and `--tip` do
            not suit it.
    """
    if arguments.arm is not None:
        return read_arm(arguments.arm, arguments.base, arguments.tip)
    if arguments.base is not None or arguments.tip is not None:
        raise InputError("--base and --tip need --arm arm.urdf")
    return None
