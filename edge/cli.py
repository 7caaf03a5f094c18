"""edge-classify: the robot computer's command."""

from __future__ import annotations

import argparse
import errno
import os
import sys
from collections.abc import Sequence
from importlib import import_module

from edge import __version__
from edge.errors import EdgeError

COMMANDS = (
    "check",
    "scan",
    "calibrate",
    "record",
    "run",
    "view",
    "replay",
    "verify",
    "bench",
    "demo",
)
"""Modules of `edge.commands`, in the order of the help; each has `add_parser(subparsers)`,
which sets `run`: a function of the parsed arguments that returns the exit status."""


def parser(wanted: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    """The command line of these commands.

    The command that was asked for is enough to parse it: the others' modules are not loaded,
    which a slow board would notice.
    """
    top = argparse.ArgumentParser(
        prog="edge-classify",
        description="Tells from a touch on a robot's skin what was touched.",
    )
    top.add_argument("--version", action="version", version=f"edge-classify {__version__}")
    commands = top.add_subparsers(dest="command", required=True, metavar="COMMAND")
    for name in wanted:
        import_module(f"edge.commands.{name}").add_parser(commands)
    return top


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""What writing answers where there is no room."""


def dispatch(top: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse and run; what goes wrong on purpose is one sentence on stderr and exit status 2."""
    arguments = top.parse_args(argv)
    try:
        status: int = arguments.run(arguments)
        sys.stdout.flush()
        return status
    except EdgeError as error:
        print(f"{top.prog}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        _discard_output()  # the reader of the lines has gone
        return 0
    except OSError as error:
        # Files are written through `edge.files`, which says so itself.
        if error.filename is not None or error.errno not in FULL:
            raise
        _discard_output()
        print(
            f"{top.prog}: standard output cannot be written: {error.strerror or error}; make room "
            "or send it elsewhere",
            file=sys.stderr,
        )
        return 2
    except KeyboardInterrupt:
        return 130


def _discard_output() -> None:
    """What is left in the buffer of stdout has nowhere to go."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; 0 fine, 1 a check failed, 2 bad usage or input."""
    words = list(sys.argv[1:] if argv is None else argv)
    wanted = [word for word in words[:1] if word in COMMANDS]
    return dispatch(parser(wanted or COMMANDS), words)


if __name__ == "__main__":
    sys.exit(main())
