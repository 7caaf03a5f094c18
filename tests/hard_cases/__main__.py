"""`python -m tests.hard_cases`: the hard cases as text and as a table in Markdown."""

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

COLUMNS = tuple(
    "case, oracle, measured, bound, worst seen, where, the usual tools, margin, price".split(
        ", "
    )
)
INDENT = {"initial_indent": " " * 5, "subsequent_indent": " " * 7}


def number(value: float) -> str:
    """Short, and whole where it is whole."""
    return (
        str(int(value)) if value == int(value) and abs(value) < 1e6 else f"{value:.1e}"
    )


def place(at: Mapping[str, Any]) -> str:
    """Parameters, as a person writes them."""
    return ", ".join(
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in at.items()
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Print and write the table; 1 if a case exceeds its bound."""
    parser = argparse.ArgumentParser(prog="hard_cases", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/hard-cases"))
    parser.add_argument("--only", default="", help="cases whose name holds this text")
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
        where = f"{place(worst.at) if worst.error else 'none'} ({worst.tried} tried)"
        row = (
            case.key,
            case.oracle,
            case.unit,
            number(case.bound),
            number(worst.error),
            where,
        )
        rows.append((*row, case.theirs(), margins.margin(case), margins.price(case)))
        took = time.perf_counter() - began
        print(f"{'ok  ' if within else 'FAIL'} {case.key}  [{took:.1f} s]")
        for name, text in zip(COLUMNS[1:], rows[-1][1:], strict=True):
            print(textwrap.fill(f"{name}: {text or '-'}", 96, **INDENT))
    lines = [COLUMNS, tuple("---" for _ in COLUMNS), *rows]
    markdown = "".join(
        "| " + " | ".join(c.replace("|", "\\|") for c in r) + " |\n" for r in lines
    )
    with write_whole(arguments.out / "table.md") as file:
        file.write(markdown.encode())
    print(
        f"{len(rows)} cases, {beyond} beyond their bound; {arguments.out / 'table.md'}"
    )
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
