"""`python -m tests.hard_cases`: the hard cases as a table, text, Markdown and CSV."""

from __future__ import annotations

import argparse
import csv
import io
import sys
import textwrap
import time
from collections.abc import Sequence
from pathlib import Path

from edge.files import write_whole
from tests.hard_cases.registry import CASES

COLUMNS = ("case", "oracle", "what is measured", "bound", "worst seen", "the usual stack")


def number(value: float) -> str:
    """Short, and whole where it is whole."""
    return str(int(value)) if value == int(value) and abs(value) < 1e6 else f"{value:.1e}"


def main(argv: Sequence[str] | None = None) -> int:
    """Print and write the table; 1 where a case is beyond its bound."""
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
        worst, at = case.worst()
        usual = "" if case.usual is None else case.usual()
        beyond += worst > case.bound
        row = (case.key, case.oracle, case.unit, number(case.bound), number(worst), usual)
        rows.append(row)
        took = time.perf_counter() - began
        mark = "ok  " if worst <= case.bound else "FAIL"
        print(f"{mark} {case.key}  [{took:.1f} s]")
        print(f"     {case.unit}: worst {row[4]}, bound {row[3]}; oracle: {case.oracle}")
        if worst > 0.0:
            print(textwrap.fill(f"at {at}", 96, initial_indent="     ", subsequent_indent=" " * 7))
        if usual:
            text = f"usual stack: {usual}"
            print(textwrap.fill(text, 96, initial_indent="     ", subsequent_indent=" " * 7))
    table = io.StringIO()
    csv.writer(table, lineterminator="\n").writerows([COLUMNS, *rows])
    lines = [COLUMNS, tuple("---" for _ in COLUMNS), *rows]
    markdown = "".join("| " + " | ".join(c.replace("|", "\\|") for c in r) + " |\n" for r in lines)
    for name, text in (("table.csv", table.getvalue()), ("table.md", markdown)):
        with write_whole(arguments.out / name) as file:
            file.write(text.encode())
    print(f"{len(rows)} cases, {beyond} beyond their bound; {arguments.out / 'table.md'}")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
