"""Speed as a ratio: each round times the rivals and then ours.

A benchmark calls `against(ours, {"rival": callable}, ...)`. Alternating rounds keep the ratio fair
on a machine whose speed drifts; the ratio is the median over the rounds. The table at the end
shows each ratio beside its target.
"""

from __future__ import annotations

import statistics
import time

import pytest

ROUNDS = 25
ROWS = pytest.StashKey[list]()


def pytest_configure(config):
    config.stash[ROWS] = []


@pytest.fixture
def note(request):
    """Add a line to the table: the rival, the ratio, its bound, and seconds of ours and theirs."""

    def add(rival, ratio, bound, ours=None, theirs=None):
        name = request.node.name.removeprefix("bench_")
        request.config.stash[ROWS].append((name, rival, ours, theirs, ratio, bound))

    return add


@pytest.fixture
def against(benchmark, note):
    """Time ours beside its rivals; `most` is {rival: largest allowed ours / rival}."""

    def run(ours, rivals, *, most=None, least=None, calls=20, rounds=ROUNDS):
        """Rounds of `calls` calls each; targets as `most` ours/rival or `least` rival/ours."""
        for function in (ours, *rivals.values()):
            function()
        seen: dict[str, list[float]] = {name: [] for name in rivals}
        own: list[float] = []

        def timed(function):
            began = time.perf_counter()
            for _ in range(calls):
                function()
            return (time.perf_counter() - began) / calls

        def rivals_first():
            for name, rival in rivals.items():
                seen[name].append(timed(rival))

        def round_of_ours():
            own.append(timed(ours))

        benchmark.pedantic(round_of_ours, setup=rivals_first, rounds=rounds, iterations=1)
        mine = statistics.median(own)
        for name, times in seen.items():
            # A warm-up round comes first and is not counted, so pair from the end.
            pairs = list(zip(own[::-1], times[::-1], strict=False))
            ratio = statistics.median(a / b for a, b in pairs)
            bound = "-"
            if most and name in most:
                bound = f"at most {most[name]:g}"
            elif least and name in least:
                bound = f"at most {1 / least[name]:.3g} ({least[name]:g} times faster)"
            note(name, ratio, bound, mine, statistics.median(times))
        if not rivals:
            note("-", None, "-", mine)
        return mine

    return run


def _micro(seconds):
    return "" if seconds is None else f"{seconds * 1e6:.1f}"


def pytest_terminal_summary(terminalreporter, config):
    rows = config.stash[ROWS]
    if not rows:
        return
    terminalreporter.section("ours beside the others (medians of alternating rounds)")
    head = ("what", "against", "ours, us", "theirs, us", "ratio", "target")
    table = [head]
    for name, rival, mine, theirs, ratio, bound in rows:
        shown = "" if ratio is None else f"{ratio:.3g}"
        table.append((name, rival, _micro(mine), _micro(theirs), shown, bound))
    widths = [max(len(row[i]) for row in table) for i in range(6)]
    for row in table:
        cells = [
            f"{cell:<{w}}" if i in (0, 1, 5) else f"{cell:>{w}}"
            for i, (cell, w) in enumerate(zip(row, widths, strict=True))
        ]
        terminalreporter.write_line("  ".join(cells).rstrip())
