"""The command line of a measuring program."""

import argparse
import sys

from edge.cli import dispatch
from edge.commands.options import within


def start(measure, description, *options):
    """Run a program, and exit with the status that it returns.

    Args:
        measure: a function of the options, by their names.
        description: of the program; the help shows its first paragraph.
        options: (name, default, help) of each. One that must be given has its type in
            place of the default; a list takes several words.
    """
    top = argparse.ArgumentParser(description=description.partition("\n\n")[0])
    for name, default, text in options:
        given = isinstance(default, type)
        kind = default if given else type(default)
        more = {"type": kind, "required": True} if given else {"default": default}
        if kind is bool:
            more = {"action": "store_true"}
        elif kind is list:
            more = {"nargs": "+", "required": True}
        elif kind is int:
            more["type"] = within(int, min(default, 1), 1e6)
        elif not given:
            more["type"] = kind
        top.add_argument(name, help=text if given else f"{text} (%(default)s)", **more)

    def run(arguments):
        words = {name: v for name, v in vars(arguments).items() if name != "run"}
        return measure(**words) or 0

    top.set_defaults(run=run)
    sys.exit(dispatch(top, None))
