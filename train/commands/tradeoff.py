"""Show the price of accuracy in time: waiting, the wire, arithmetic.

Writes OUT/report.html (nothing outside it is linked), each plot as PNG, each table as
CSV, and front.json, which `edge-classify export --front` reads.
"""

import argparse
import math
from contextlib import suppress

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
    option(
        "--cost",
        type=cost,
        default=(10.0, 1.0),
        metavar="wrong=10,second=1",
        help="your price of a wrong decision and of a second's wait: the report names the window "
        "of least cost (default: wrong=10,second=1)",
    )
    text = "try few candidates at each window; the table of savings has all as a row"
    option("--quick", action="store_true", help=text)
    option("--task", help="task of front.json (default: category, or else the first)")


def cost(text: str) -> tuple[float, float]:
    """The prices of a wrong decision and of a second, out of `wrong=10,second=1`.

    Raises:
        ArgumentTypeError: the text has another form, or a price is below 0 or not
            finite.
    """
    with suppress(ValueError, KeyError):
        prices = dict(term.split("=") for term in text.split(","))
        wrong = float(prices.pop("wrong"))
        second = float(prices.pop("second"))
        if not prices and 0.0 <= wrong < math.inf and 0.0 <= second < math.inf:
            return wrong, second
    raise argparse.ArgumentTypeError(f"must be like wrong=10,second=1, not {text!r}")


def run(arguments: argparse.Namespace) -> int:
    """Work and write."""
    from train.tradeoff.run import Options, require_enough, tradeoff

    if arguments.check:
        require_enough(len(find(arguments.data)))
        return 0
    check_writable(arguments.out)  # before the work
    if arguments.board is None:
        raise InputError("give --board board.json, which `edge-classify bench` writes")
    options = Options(
        task=arguments.task,
        wrong=arguments.cost[0],
        second=arguments.cost[1],
        quick=arguments.quick,
        jobs=arguments.jobs,
    )
    print(tradeoff(arguments.data, arguments.out, arguments.board, options))
    return 0
