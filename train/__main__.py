"""`python -m train`: the workstation's commands."""

import argparse
import sys
from collections.abc import Iterable, Sequence

from edge.app.cli import add_commands, dispatch
from edge.interrupt import exit_on_sigterm

COMMANDS = {
    "import": "train.commands.import_",
    "simulate": "train.commands.simulate",
    "study": "train.commands.study",
    "tradeoff": "train.commands.tradeoff",
    "show": "train.commands.show",
    "thresholds": "train.commands.thresholds",
}
"""Modules by command; see `edge.app.cli.add_commands`."""


def parser(names: Iterable[str] = COMMANDS) -> argparse.ArgumentParser:
    """The command line, with the named commands alone: loading all takes half a
    second."""
    top = argparse.ArgumentParser(
        prog="edge-classify",
        description="Imports, simulates, studies and draws recordings; `python -m export` makes "
        "a model of them.",
    )
    list(add_commands(top, {name: COMMANDS[name] for name in names}))
    return top


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; 0 fine, 1 a check failed, 2 bad usage or input."""
    words = list(sys.argv[1:] if argv is None else argv)
    try:
        names = [word for word in words[:1] if word in COMMANDS]
        return dispatch(parser(names or COMMANDS), words)
    except KeyboardInterrupt:  # while the commands were being loaded
        return 130


if __name__ == "__main__":
    exit_on_sigterm()
    sys.exit(main())
