"""`python -m tests.hard_cases`: the hard cases as text and as a table in Markdown."""

from __future__ import annotations

import argparse
import sys
import textwrap
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from edge.files import write_whole
from tests.hard_cases import margins
from tests.hard_cases.registry import CASES

COLUMNS = (
    "case",
    "oracle",
    "measured",
    "bound",
    "worst seen",
    "where",
    "the usual tools",
    "margin",
    "price",
)


def number(value: float) -> str:
    """Short, and whole where it is whole."""
    return str(int(value)) if value == int(value) and abs(value) < 1e6 else f"{value:.1e}"


def place(at: Mapping[str, Any]) -> str:
    """Parameters, as a person writes them."""
    return ", ".join(
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in at.items()
    )


def say(text: str) -> None:
    """Print a paragraph under a case."""
    if text:
        print(textwrap.fill(text, 96, initial_indent="     ", subsequent_indent=" " * 7))


def main(argv: Sequence[str] | None = None) -> int:
    """Print and write the table; 1 if a case exceeds its bound."""
    parser = argparse.ArgumentParser(prog="hard_cases", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/hard-cases"))
    parser.add_argument("--only", default="", help="cases whose group and name hold this text")
    arguments = parser.parse_args(argv)
    rows: list[tuple[str, ...]] = []
    beyond = 0
    for case in CASES:
        if arguments.only not in case.key:
            continue
        began = time.perf_counter()
        worst = case.worst()
        within = worst.error <= case.bound
        beyond += not within
        error, bound, tried = number(worst.error), number(case.bound), f"{worst.tried} tried"
        where = f"{place(worst.at)} ({tried})" if worst.error else f"none of {tried}"
        usual, far, cost = case.theirs(), margins.margin(case), margins.price(case)
        rows.append((case.key, case.oracle, case.unit, bound, error, where, usual, far, cost))
        took = time.perf_counter() - began
        print(f"{'ok  ' if within else 'FAIL'} {case.key}  [{took:.1f} s]")
        say(f"{case.unit}: worst {error}, bound {bound}; oracle: {case.oracle}")
        say(f"worst at {where}" if worst.error else f"{tried}")
        say(usual and f"the usual tools: {usual}")
        say(f"margin: {far}")
        say(cost and f"price: {cost}")
    lines = [COLUMNS, tuple("---" for _ in COLUMNS), *rows]
    markdown = "".join("| " + " | ".join(c.replace("|", "\\|") for c in r) + " |\n" for r in lines)
    with write_whole(arguments.out / "table.md") as file:
        file.write(markdown.encode())
    print(f"{len(rows)} cases, {beyond} beyond their bound; {arguments.out / 'table.md'}")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
