"""The options that name the arm which carries the skin."""

from __future__ import annotations

import argparse

from edge.errors import InputError
from edge.touch.arm import Chain


def add_arm(parser: argparse.ArgumentParser, use: str) -> None:
    """Add `--arm` and, for a URDF, its two links; `use` says what the arm is for."""
    parser.add_argument(
        "--arm",
        metavar="arm.toml|arm.urdf",
        help=f"the joints of the arm that carries the skin, {use}",
    )
    parser.add_argument("--base", metavar="LINK", help="of a URDF: where its chain begins")
    parser.add_argument("--tip", metavar="LINK", help="of a URDF: the link that carries the skin")


def open_arm(arguments: argparse.Namespace) -> Chain | None:
    """The arm that the options name, or None.

    Raises:
        InputError: the file is no chain, or `--base` and `--tip` do not go with it.
    """
    if arguments.arm is None:
        for name in ("base", "tip"):
            if getattr(arguments, name) is not None:
                raise InputError(f"--{name} needs --arm arm.urdf")
        return None
    return Chain.from_file(arguments.arm, arguments.base, arguments.tip)
