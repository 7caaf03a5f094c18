"""Command-line options of the commands that write trials: their labels and the arm."""

import argparse

from edge.errors import InputError
from edge.touch.arm import Chain, read_arm


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
        help="in a URDF, the first link of the arm",
    )
    parser.add_argument(
        "--tip",
        metavar="LINK",
        help="in a URDF, the link that carries the skin",
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
