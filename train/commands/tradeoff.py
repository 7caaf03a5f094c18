"""Show the price of accuracy in time: waiting, the wire, arithmetic.

Writes OUT/report.html (nothing outside it is linked), each plot as PNG, each table as
CSV, and front.json, which `edge-classify export --front` reads.
"""

import argparse

from edge.errors import InputError
from edge.record.saving import find
from edge.writing import check_writable
from train.report.options import add_report_options


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_report_options(parser, "build/tradeoff")
    option = parser.add_argument
    text = "file that `edge-classify bench` wrote of a model fitted on these recordings"
    option("--board", metavar="board.json", help=text)
    text = "only see whether there are enough recordings, before the long work"
    option("--check", action="store_true", help=text)
    text = "try few candidates at each window"
    option("--quick", action="store_true", help=text)
    option("--task", help="task of front.json (default: category, or else the first)")


def run(arguments: argparse.Namespace) -> int:
    """Work and write."""
    from train.tradeoff.run import require_enough, tradeoff

    if arguments.check:
        require_enough(len(find(arguments.data)))
        return 0
    check_writable(arguments.out)  # before the work
    if arguments.board is None:
        raise InputError("give --board board.json, which `edge-classify bench` writes")
    options = {name: getattr(arguments, name) for name in ("task", "quick", "jobs")}
    print(tradeoff(arguments.data, arguments.out, arguments.board, **options))
    return 0
