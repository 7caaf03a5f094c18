"""`python -m tests.checks.hard_cases`: the hard cases as text, and as the table of the page."""

import argparse
import sys
import textwrap
import time
from collections.abc import Mapping
from dataclasses import dataclass

from tests.checks.bench import tables
from tests.checks.hard_cases import margins
from tests.checks.hard_cases.registry import CASES

INDENT = {"initial_indent": " " * 5, "subsequent_indent": " " * 7}


def number(value):
    """Short, and whole where it is whole."""
    whole = value == int(value) and abs(value) < 1e6
    return str(int(value)) if whole else f"{value:.1e}"


def place(worst):
    """The parameters of the largest error, as a person writes them."""
    if worst.error == 0.0:
        return f"none in {worst.count} tried"
    parameters = [
        f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}"
        for name, value in worst.at.items()
    ]
    return f"{number(worst.error)} at {', '.join(parameters)} of {worst.count} tried"


@dataclass(frozen=True)
class Entry:
    """A case in the two tables of the page, and for the terminal.

    Attributes:
        answer: how far the case holds.
        judge: the oracle, and what the usual tools answer.
    """

    answer: Mapping[str, str]
    judge: Mapping[str, str]

    @classmethod
    def of(cls, case, worst):
        """The entry of a case; measures its margin and the usual tools."""
        answer = {
            "hard case": case.key,
            "holds to": margins.margin(case),
            "bound": number(case.bound),
            "largest error": place(worst),
        }
        judge = {
            "hard case": case.key,
            "oracle": case.oracle,
            "error": case.unit,
            "the usual tools": case.theirs() or "-",
        }
        return cls(_escaped(answer), _escaped(judge))


def _escaped(row):
    return {name: text.replace("|", "\\|") for name, text in row.items()}


def printed(case):
    """Whether a case is within its bound, and its entry, which is printed."""
    began = time.perf_counter()
    worst = case.worst()
    within = worst.error <= case.bound
    entry = Entry.of(case, worst)
    took = time.perf_counter() - began
    print(f"{'ok  ' if within else 'FAIL'} {case.key}  [{took:.1f} s]")
    for name, text in {**entry.judge, **entry.answer}.items():
        if text != case.key:
            print(textwrap.fill(f"{name}: {text}", 96, **INDENT))
    return within, entry


def main(argv=None):
    """Print the cases; 1 if one exceeds its bound. All of them renew the page's table."""
    parser = argparse.ArgumentParser(prog="hard_cases", description=__doc__)
    parser.add_argument("--only", default="", help="cases whose name holds this text")
    arguments = parser.parse_args(argv)
    cases = [case for case in CASES if arguments.only in case.key]
    if not cases:
        parser.error(f"no case's name holds {arguments.only!r}")
    entries = []
    beyond = 0
    for case in cases:
        within, entry = printed(case)
        beyond += not within
        entries.append(entry)
    print(f"{len(entries)} cases, {beyond} beyond their bound")
    if cases == CASES:
        answers = [entry.answer for entry in entries]
        judges = [entry.judge for entry in entries]
        tables.write("hard_cases", [answers, judges], "make hard-cases")
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
