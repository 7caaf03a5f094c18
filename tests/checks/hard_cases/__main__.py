"""`make hard-cases`: the tables of the hard cases."""

import sys

from edge.errors import EdgeError
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.checks.hard_cases import margins
from tests.checks.hard_cases.registry import CASES
from train.progress import bar


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


def rows_of(case, worst):
    """How far a case holds, and its oracle with what the usual tools answer: a row of
    each table."""
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
    return [
        {name: text.replace("|", "\\|") for name, text in row.items()}
        for row in (answer, judge)
    ]


def measure(only):
    """Print the tables of the cases, which all cases renew; 1 if one exceeds its bound.

    Raises:
        EdgeError: no case is left.
    """
    cases = [case for case in CASES if only in case.key]
    if not cases:
        raise EdgeError(f"no case's name holds {only!r}")
    rows = []
    beyond = []
    for case in bar(cases, desc="hard cases"):
        worst = case.worst()
        rows.append(rows_of(case, worst))
        if not worst.error <= case.bound:
            beyond.append(case.key)
    written = map(list, zip(*rows, strict=True))
    if cases == CASES:
        tables.write("hard_cases", written, "make hard-cases")
    else:
        print("\n\n".join(map(tables.markdown, written)))
    if beyond:
        print(f"beyond their bound: {'; '.join(beyond)}", file=sys.stderr)
    return 1 if beyond else 0


if __name__ == "__main__":
    start(measure, __doc__, ("--only", "", "cases whose name holds this text"))
