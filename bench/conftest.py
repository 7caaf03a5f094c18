"""Speed as a ratio: each round times the rivals and then ours.

A benchmark calls `against(ours, {"rival": callable}, ...)`. Alternating rounds keep the ratio fair
on a machine whose speed drifts; the ratio is the median over the rounds. The table at the end
shows each ratio beside its target.
"""

from __future__ import annotations

import statistics
import time

import pytest

ROWS = pytest.StashKey[list]()
HEAD = ("what", "against", "ours, us", "theirs, us", "ratio", "target")


def pytest_configure(config):
    config.stash[ROWS] = [HEAD]


@pytest.fixture
def note(request):
    """Add a line to the table: the rival, the ratio, its bound, and seconds of ours and theirs."""

    def add(rival, ratio, bound, ours=None, theirs=None):
        micro = ("" if seconds is None else f"{seconds * 1e6:.1f}" for seconds in (ours, theirs))
        shown = "" if ratio is None else f"{ratio:.3g}"
        name = request.node.name.removeprefix("bench_")
        request.config.stash[ROWS].append((name, rival, *micro, shown, bound))

    return add


@pytest.fixture
def against(note):
    """Time ours beside its rivals; returns seconds of ours.

    Each of the rounds has so many calls. `most` is {rival: largest allowed ours / rival}.
    """

    def timed(function, calls):
        began = time.perf_counter()
        for _ in range(calls):
            function()
        return (time.perf_counter() - began) / calls

    def run(ours, rivals, *, most=None, calls=20, rounds=25):
        functions = [*rivals.values(), ours]
        for function in functions:
            function()
        seconds = [[timed(function, calls) for function in functions] for _ in range(rounds)]
        mine = statistics.median(row[-1] for row in seconds)
        for i, name in enumerate(rivals):
            ratio = statistics.median(row[-1] / row[i] for row in seconds)
            bound = f"at most {most[name]:.3g}" if name in (most or {}) else "-"
            note(name, ratio, bound, mine, statistics.median(row[i] for row in seconds))
        if not rivals:
            note("-", None, "-", mine)
        return mine

    return run


def pytest_terminal_summary(terminalreporter, config):
    rows = config.stash[ROWS]
    terminalreporter.section("ours beside the others (medians of alternating rounds)")
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
        terminalreporter.write_line("  ".join(cells).rstrip())
