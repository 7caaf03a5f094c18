"""`python -m tests.hard_cases`: the hard cases as text, and as the table of the page."""

import argparse
import sys
import textwrap
import time
from collections.abc import Mapping, Sequence
from typing import Any

from tests.bench import tables
from tests.hard_cases import margins
from tests.hard_cases.cases import Case, Worst
from tests.hard_cases.registry import CASES

INDENT = {"initial_indent": " " * 5, "subsequent_indent": " " * 7}


def number(value: float) -> str:
    """Short, and whole where it is whole."""
    whole = value == int(value) and abs(value) < 1e6
    return str(int(value)) if whole else f"{value:.1e}"


def place(worst: Worst) -> str:
    """The parameters of the largest error, as a person writes them."""
    if worst.error == 0.0:
        return f"none in {worst.tried} tried"
    parameters = [
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in worst.at.items()
    ]
    return f"{number(worst.error)} at {', '.join(parameters)} of {worst.tried} tried"


def row_of(case: Case, worst: Worst) -> Mapping[str, str]:
    """The case's row of the table; measures its margin, its price and the usual tools."""
    row = {
        "hard case": case.key,
        "oracle": case.oracle,
        "error": case.unit,
        "bound": number(case.bound),
        "largest error": place(worst),
        "margin": margins.margin(case),
        "the usual tools": case.theirs() or "-",
        "cost": margins.price(case),
    }
    return {name: text.replace("|", "\\|") for name, text in row.items()}


def main(argv: Sequence[str] | None = None) -> int:
    """Print the cases; 1 if one exceeds its bound. All of them renew the page's table."""
    parser = argparse.ArgumentParser(prog="hard_cases", description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name holds this text")
    arguments = parser.parse_args(argv)
    rows: list[Mapping[str, Any]] = []
    beyond = 0
    for case in CASES:
        if arguments.only not in case.key:
            continue
        began = time.perf_counter()
        worst = case.worst()
        within = worst.error <= case.bound
        beyond += not within
        row = row_of(case, worst)
        rows.append(row)
        took = time.perf_counter() - began
        print(f"{'ok  ' if within else 'FAIL'} {case.key}  [{took:.1f} s]")
        for name, text in row.items():
            if text != case.key:
                print(textwrap.fill(f"{name}: {text}", 96, **INDENT))
    print(f"{len(rows)} cases, {beyond} beyond their bound")
    if len(rows) == len(CASES):
        tables.write("hard_cases", [rows], "make hard-cases")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
