"""The command line of a measuring program."""

import argparse
import sys

from edge.app.cli import dispatch
from edge.app.options import within

LEAST = {int: 1, float: 1e-3}
"""Of an option, unless its default is less."""


def kind_of(default):
    """How argparse takes an option."""
    if default is list:
        return {"nargs": "+", "required": True}
    if default == []:
        return {"nargs": "*", "default": default}
    if default == [int]:
        return {"nargs": "*", "type": within(int, 1, 1e6), "default": []}
    if isinstance(default, type):
        return {"type": default, "required": True}
    if isinstance(default, bool):
        return {"action": "store_true"}
    kind = type(default)
    if kind in LEAST:
        least = min(default, LEAST[kind])
        return {"type": within(kind, least, 1e6), "default": default}
    return {"type": kind, "default": default}


def start(measure, description, *options):
    """Run a program, and exit with the status that it returns.

    Args:
        measure: a function of the options, by their names.
        description: of the program; the help shows its first paragraph.
        options: (name, default, help) of each. One that must be given has its type in
            place of the default; a list takes several words, or numbers if it is [int].
    """
    top = argparse.ArgumentParser(
        description=description.partition("\n\n")[0],
        formatter_class=argparse.ArgumentDefaultsHelpFormatter,
    )
    names = [name.lstrip("-").replace("-", "_") for name, _, _ in options]
    for name, default, text in options:
        top.add_argument(name, help=text, **kind_of(default))

    def run(arguments):
        return measure(**{name: vars(arguments)[name] for name in names}) or 0

    top.set_defaults(run=run)
    sys.exit(dispatch(top, None))
