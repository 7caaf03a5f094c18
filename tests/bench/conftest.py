"""Speed as a ratio: each round times the rivals and then ours.

A benchmark calls `against(ours, {"rival": callable}, ...)`. Alternating rounds and
processor time keep the ratio fair on a machine whose speed drifts and that other
programs share; the ratio is the median over the rounds, printed beside its target.
"""

from __future__ import annotations

import statistics
import time
import timeit

import pytest

from tests.bench import tables

ROWS = pytest.StashKey()
"""The rows of the table of all benchmarks of a run."""


def pytest_sessionfinish(session):
    """Write the table of a whole run; part of the benchmarks would replace it."""
    rows = session.config.stash.get(ROWS, [])
    if rows and not session.config.option.keyword:
        tables.write("bench", [rows], "make bench")


@pytest.fixture
def note(request, capsys):
    """Prints the rival, the ratio, its bound, and seconds of ours and theirs as
    microseconds."""
    name = request.node.name.removeprefix("bench_")

    def add(rival, ratio, bound, *seconds):
        row = {"benchmark": name, "beside": rival, "ratio": f"{ratio:.3g}"}
        row["bound"] = bound
        row["ours"] = ""
        row["theirs"] = ""
        for column, duration in zip(("ours", "theirs"), seconds, strict=False):
            row[column] = f"{duration * 1e6:.1f} us"
        request.config.stash.setdefault(ROWS, []).append(row)
        times = "".join(f"{duration * 1e6:>10.1f} us" for duration in seconds)
        with capsys.disabled():
            print(f"\n{name:<32} {rival:<44} {ratio:>8.3g}  {bound:<14}{times}", end="")

    return add


@pytest.fixture
def against(note):
    """Times ours beside its rivals; returns seconds of ours.

    Each of the rounds has so many calls. `most` is {rival: largest allowed ours /
    rival}; `timer` counts processor time of all threads, unless other processes are
    timed.
    """

    def run(ours, rivals, *, most=None, calls=20, rounds=25, timer=time.process_time):
        functions = [*rivals.values(), ours]
        for function in functions:
            function()
        seconds = [
            [
                timeit.timeit(function, number=calls, timer=timer) / calls
                for function in functions
            ]
            for _ in range(rounds)
        ]
        mine = statistics.median(row[-1] for row in seconds)
        for i, name in enumerate(rivals):
            ratio = statistics.median(row[-1] / row[i] for row in seconds)
            bound = f"at most {most[name]:.3g}" if name in (most or {}) else "-"
            note(name, ratio, bound, mine, statistics.median(row[i] for row in seconds))
        return mine

    return run
