"""`python -m train`: the workstation's commands."""

import argparse
import sys
from collections.abc import Sequence

from edge.cli import add_commands, dispatch

COMMANDS = ("import_", "simulate", "study", "tradeoff", "show", "split", "thresholds")
"""Modules of `train.commands`; see `edge.cli.add_commands`."""


def parser() -> argparse.ArgumentParser:
    """The whole command line."""
    top = argparse.ArgumentParser(
        prog="train",
        description="Imports, simulates, studies and draws recordings; `python -m export` makes "
        "a model of them.",
    )
    list(add_commands(top, "train.commands", COMMANDS))
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; 0 fine, 1 a check failed, 2 bad usage or input."""
    try:
        return dispatch(parser(), argv)
    except KeyboardInterrupt:  # while the commands were being loaded
        return 130


if __name__ == "__main__":
    sys.exit(main())
