"""edge-classify: the command of the robot's computer."""

from __future__ import annotations

import argparse
import atexit
import errno
import gc
import io
import logging
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
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
    "info",
    "verify",
    "bench",
    "fake",
    "demo",
)
"""Modules of `edge.commands`, in the order of the help; see `add_commands`."""


def parser(wanted: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    """The command line with the commands `wanted`.

    To run one command, that one is enough: a slow board need not load the modules of the others.
    """
    top = argparse.ArgumentParser(
        prog="edge-classify",
        description="Tells what a robot touched from what its skin felt.",
        epilog="`edge-classify COMMAND --help` explains a command. At a terminal, commands print "
        "text; where stdout is piped, one JSON object per line.",
    )
    top.add_argument("--version", action="version", version=f"edge-classify {__version__}")
    for command in add_commands(top, "edge.commands", wanted):
        command.add_argument(
            "--json", action="store_true", help="print JSON lines, as if stdout were no terminal"
        )
        command.add_argument("-v", "--verbose", action="store_true", help="say more on stderr")
        command.add_argument(
            "-q", "--quiet", action="store_true", help="say nothing on stderr but errors"
        )
    return top


def add_commands(
    top: argparse.ArgumentParser, package: str, names: Sequence[str]
) -> Iterator[argparse.ArgumentParser]:
    """Add subcommands, each a module of the package, and give their parsers.

    A module has `HELP` (a line), `DESCRIPTION`, `add_options(parser)`, and `run`, a function of
    the parsed arguments that returns the exit status.
    """
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name in names:
        module = import_module(f"{package}.{name}")
        command = commands.add_parser(
            name.rstrip("_"), help=module.HELP, description=module.DESCRIPTION
        )
        module.add_options(command)
        command.set_defaults(run=module.run)
        yield command


FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of writing to a disk or a quota that is full."""


def complete(top: argparse.ArgumentParser) -> None:
    """Answer a shell that asks for completions, if argcomplete is installed."""
    if "_ARGCOMPLETE" in os.environ:
        try:
            import argcomplete
        except ImportError:
            return
        argcomplete.autocomplete(top)


def dispatch(top: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse and run; an expected error becomes one sentence on stderr and exit status 2."""
    complete(top)
    arguments = top.parse_args(argv)
    level = logging.INFO
    if getattr(arguments, "verbose", False):
        level = logging.DEBUG
    elif getattr(arguments, "quiet", False):
        level = logging.ERROR
    with messages(top.prog, level):
        return _run(top, arguments)


@contextmanager
def messages(prog: str, level: int = logging.INFO) -> Iterator[None]:
    """Within the block, log messages of this level and above go to stderr, one line each."""
    handler = logging.StreamHandler()
    handler.setFormatter(logging.Formatter(f"{prog}: %(message)s"))
    loggers = [logging.getLogger(name) for name in ("edge", "train", "export")]
    before = [logger.level for logger in loggers]
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(level)
    try:
        yield
    finally:
        for logger, was in zip(loggers, before, strict=True):
            logger.removeHandler(handler)
            logger.setLevel(was)


def _run(top: argparse.ArgumentParser, arguments: argparse.Namespace) -> int:
    try:
        status: int = arguments.run(arguments)
        sys.stdout.flush()
        return status
    except EdgeError as error:
        print(f"{top.prog}: {error}", file=sys.stderr)
        return 2
    except BrokenPipeError:
        _discard_output()  # whoever read the output has gone
        return 0
    except OSError as error:
        # `edge.files` reports errors of the files that it writes.
        if error.filename is not None or error.errno not in FULL:
            raise
        _discard_output()
        print(
            f"{top.prog}: standard output cannot be written: {error.strerror or error}; free some "
            "space or redirect the output elsewhere",
            file=sys.stderr,
        )
        return 2
    except KeyboardInterrupt:
        return 130


def _complete_stdio() -> None:
    """Give the program the standard streams that it was started without.

    The next file to be opened would take the descriptor of one that is closed, and be written to.
    What an encoding does not have is written as an escape.
    """
    for name, descriptor in (("stdin", 0), ("stdout", 1), ("stderr", 2)):
        if getattr(sys, name) is None:
            null = os.open(os.devnull, os.O_RDWR)
            if null != descriptor:
                os.dup2(null, descriptor)
                os.close(null)
            setattr(sys, name, open(descriptor, "r" if descriptor == 0 else "w", closefd=False))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _discard_output() -> None:
    """Redirect stdout, so that flushing its buffer at exit cannot fail again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; returns 0 if all is well, 1 if a check failed, 2 for bad usage or input."""
    _complete_stdio()
    words = list(sys.argv[1:] if argv is None else argv)
    wanted = [word for word in words[:1] if word in COMMANDS]
    top = parser(wanted or COMMANDS)
    if not words and "_ARGCOMPLETE" not in os.environ:
        top.print_help()
        return 2
    if not wanted and words and not words[0].startswith("-"):
        from difflib import get_close_matches  # a slow board starts sooner without it

        near = get_close_matches(words[0], COMMANDS, 1, 0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"the commands are {', '.join(COMMANDS)}"
        print(f"{top.prog}: there is no command {words[0]!r}; {hint}", file=sys.stderr)
        return 2
    return dispatch(top, words)


# The interpreter's last collection would visit all that was ever imported, and a program that is
# told to end takes twice as long.
atexit.register(gc.freeze)

if __name__ == "__main__":
    sys.exit(main())
