"""The `edge-classify` command line: parses the arguments and runs one subcommand."""

import argparse
import atexit
import errno
import gc
import io
import logging
import os
import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module

from edge import __version__
from edge.app.commands import workstation
from edge.errors import EdgeError, InputError
from edge.interrupt import delayed

COMMANDS = {
    "check": "edge.app.commands.check",
    "scan": "edge.app.commands.scan",
    "calibrate": "edge.app.commands.calibrate",
    "record": "edge.app.commands.record",
    "label": "edge.app.commands.label",
    "run": "edge.app.commands.run",
    "view": "edge.app.commands.view",
    "replay": "edge.app.commands.replay",
    "explain": "edge.app.commands.explain",
    "info": "edge.app.commands.info",
    "verify": "edge.app.commands.verify",
    "install": "edge.app.commands.install",
    "bench": "edge.app.commands.bench",
    "fake": "edge.app.commands.fake",
    "demo": "edge.app.commands.demo",
}
"""Modules by command, in the order in which the help lists them; see `add_commands`."""
UNWRITABLE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO)
"""Errors of writing to a full disk, beyond a quota, or to a terminal that has gone."""


def parser(names: Iterable[str] = COMMANDS) -> argparse.ArgumentParser:
    """The command line, with the named commands alone.

    A slow board starts sooner if it loads only the command that it runs.
    """
    top = argparse.ArgumentParser(
        prog="edge-classify",
        description="Tells from a robot's skin what the robot has touched.",
        epilog="`edge-classify COMMAND --help` explains a command. Commands print text to a "
        "terminal, and one JSON object per line to a pipe or a file. In a checkout of the "
        "project, edge-classify export, import, simulate, study, tradeoff, show "
        "and thresholds run the workstation's commands.",
    )
    top.add_argument(
        "--version",
        action="version",
        version=f"edge-classify {__version__}",
    )
    for command in add_commands(top, {name: COMMANDS[name] for name in names}):
        flag = partial(command.add_argument, action="store_true")
        flag("--json", help="JSON lines even to a terminal")
        flag("-q", "--quiet", help="errors alone on stderr")
    return top


def add_commands(
    top: argparse.ArgumentParser, modules: Mapping[str, str]
) -> Iterator[argparse.ArgumentParser]:
    """Add each module as the subcommand of its name, and yield the subcommands'
    parsers.

    A module's docstring is its help: the first line stands in the list of commands, the
    rest in the command's own help. The module has `add_options(parser)` and
    `run(arguments)`, which returns the exit status.
    """
    commands = top.add_subparsers(title="commands", metavar="COMMAND", required=True)
    for name, path in modules.items():
        with delayed():
            module = import_module(path)
        headline, _, description = (module.__doc__ or name).partition("\n\n")
        brief = headline[0].lower() + headline[1:].rstrip(".")
        command = commands.add_parser(name, help=brief, description=description)
        module.add_options(command)
        command.set_defaults(run=module.run)
        yield command


def dispatch(top: argparse.ArgumentParser, argv: Sequence[str] | None) -> int:
    """Parse the arguments and run the command; returns the exit status.

    An expected error becomes one sentence on stderr and exit status 2 or 3. Meanwhile,
    log messages are printed to stderr, one line each. A shell that asks for completions
    gets them if argcomplete is installed.
    """
    _open_missing_streams()
    if "_ARGCOMPLETE" in os.environ:
        with suppress(ImportError):
            import argcomplete

            argcomplete.autocomplete(top)
    arguments = parsed(top, list(sys.argv[1:] if argv is None else argv))
    with _messages(top.prog, getattr(arguments, "quiet", False)):
        return _status(top.prog, arguments)


def parsed(top: argparse.ArgumentParser, words: Sequence[str]) -> argparse.Namespace:
    """The arguments, with `command`, the line that gave them.

    A word that stands without an option is the model or the skin, by its suffix. An
    empty word, which a variable without a value leaves, is refused: as a path it would
    be the current folder.
    """
    for i, word in enumerate(words):
        if not word or (word.startswith("-") and word.endswith("=")):
            where = word or f"after {[top.prog, *words][i]}"
            top.error(f"an argument is empty ({where}); give it a value")
    arguments, bare = top.parse_known_args(words)
    arguments.command = shlex.join([top.prog, *words])
    for word in bare:
        if not _placed(word, arguments):
            top.error(f"unrecognized arguments: {word}")
    needed = getattr(arguments, "needs", None)
    if needed and getattr(arguments, needed) is None:
        top.error(f"a {needed} is required: name its file, with --{needed} or without")
    return arguments


def _placed(word: str, arguments: argparse.Namespace) -> bool:
    """Take a bare word as the model or the skin; whether the command lacks one."""
    names = ["skin", "model"] if word.endswith(".toml") else ["model", "skin"]
    for name in names:
        if getattr(arguments, name, "") is None and not word.startswith("-"):
            setattr(arguments, name, word)
            return True
    return False


@contextmanager
def _messages(program: str, quiet: bool) -> Iterator[None]:
    """Print log messages to stderr meanwhile, or only errors."""
    handler = logging.StreamHandler()
    handler.setLevel(logging.ERROR if quiet else logging.INFO)
    handler.setFormatter(logging.Formatter(f"{program}: %(message)s"))
    loggers = list(map(logging.getLogger, ("edge", "train", "export")))
    for logger in loggers:
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeHandler(handler)


def _status(program: str, arguments: argparse.Namespace) -> int:
    """Run the command; the exit status."""
    try:
        status: int = arguments.run(arguments)
        sys.stdout.flush()
        return status
    except EdgeError as error:
        print(f"{program}: {error}", file=sys.stderr)
        # A device may be there a moment later.
        return 2 if isinstance(error, InputError) else 3
    except BrokenPipeError:
        _discard_output()  # the reader of the output has closed the pipe
        return 0
    except OSError as error:
        # Even to ask whether a file exists fails in a folder that is closed to the user.
        # An error without a file's name is of stdout, as `edge.files` reports the others.
        if error.filename is not None:
            problem = f"{error.filename}: cannot be used: {error.strerror}"
            print(f"{program}: {InputError(problem)}", file=sys.stderr)
            return 2
        if error.errno not in UNWRITABLE:
            raise
        _discard_output()
        problem = f"standard output cannot be written: {error.strerror}"
        print(f"{program}: {problem}; redirect it to another place", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def _open_missing_streams() -> None:
    """Open the null device for each standard stream that was closed before the program
    began.

    Otherwise the next file to be opened would take the stream's descriptor, and receive
    the printed lines. Characters that the output's encoding lacks are then written as
    escapes.
    """
    for name, mode in (("stdin", "r"), ("stdout", "w"), ("stderr", "w")):
        if getattr(sys, name) is None:
            # The lowest descriptor that is free is the stream's own.
            setattr(sys, name, open(os.devnull, mode))  # noqa: SIM115
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _discard_output() -> None:
    """Redirect stdout to the null device, so that flushing it at exit cannot fail
    again."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Returns:
        0 for success, 1 if a check failed, 2 for bad usage or input, 3 for a device
        that fails.
    """
    words = list(sys.argv[1:] if argv is None else argv)
    first = words[0] if words else ""
    top = parser([first] if first in COMMANDS else COMMANDS)
    if not words and "_ARGCOMPLETE" not in os.environ:
        top.print_help()
        return 2
    if not first or first.startswith("-") or first in COMMANDS:
        return dispatch(top, words)
    if first in workstation.COMMANDS:
        return workstation.run(words)
    commands = [*COMMANDS, *workstation.COMMANDS]
    return workstation.refuse_command(top.prog, first, commands)


# The interpreter's last garbage collection would visit every imported object, which
# doubles the time that the program takes to end.
atexit.register(gc.freeze)

if __name__ == "__main__":
    sys.exit(main())
