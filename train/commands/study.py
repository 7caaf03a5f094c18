"""Repeat every analysis of the paper on a data set, beside the paper's own numbers.

Writes OUT/report.html, which needs no other file, each plot as PNG and each table as
CSV.
"""

import argparse

from edge.app.options import within
from edge.writing import check_writable
from train.report.options import add_report_options


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    add_report_options(parser, "build/study")
    option = parser.add_argument
    option(
        "--scene",
        help="the scene that the recordings were simulated from: adds the paper's numbers",
    )
    option(
        "--seeds",
        type=within(int, 1, 1000),
        default=1,
        help="data sets of the scene whose mean is set beside the paper's numbers (default: 1, "
        "these recordings alone; with 8, each takes about half a minute)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Work and write."""
    from train.study.run import study

    check_writable(arguments.out)  # before the work

    options = {name: getattr(arguments, name) for name in ("scene", "jobs", "seeds")}
    print(study(arguments.data, arguments.out, **options))
    return 0
