"""Speed as a ratio: each round times the rivals and then ours.

A benchmark calls `against(ours, {"rival": callable}, ...)`. Alternating rounds and
processor time keep the ratio fair on a machine whose speed drifts and that other
programs share; the ratio is the median over the rounds, printed beside its target.
"""

import time
import timeit
from itertools import zip_longest

import numpy as np
import pytest

from tests.checks.bench import tables

ROWS = pytest.StashKey()
"""The rows of the table of all benchmarks of a run."""


def pytest_collection_modifyitems(items):
    """A benchmark may take its time."""
    for item in items:
        item.add_marker(pytest.mark.slow)


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
        times = [f"{duration * 1e6:.1f} us" for duration in seconds]
        row = {"benchmark": name, "beside": rival, "ratio": f"{ratio:.3g}"}
        row["bound"] = bound
        row |= zip_longest(("ours", "theirs"), times, fillvalue="")
        request.config.stash.setdefault(ROWS, []).append(row)
        columns = "".join(f"{text:>13}" for text in times)
        with capsys.disabled():
            print(
                f"\n{name:<32} {rival:<44} {ratio:>8.3g}  {bound:<14}{columns}", end=""
            )

    return add


@pytest.fixture
def against(note):
    """Times ours beside its rivals; returns seconds of ours.

    Each of the rounds has so many calls. `rivals` is {name: (its function, largest
    allowed ours / rival or None)}.
    """

    def run(ours, rivals, *, calls=20, rounds=25):
        functions = [*(rival for rival, _ in rivals.values()), ours]
        for function in functions:
            function()
        seconds = np.empty((rounds, len(functions)))
        for place in np.ndindex(seconds.shape):
            function = functions[place[1]]
            # Processor time of all threads.
            whole = timeit.timeit(function, number=calls, timer=time.process_time)
            seconds[place] = whole / calls
        medians = np.median(seconds, axis=0)
        ratios = np.median(seconds[:, -1:] / seconds, axis=0)
        for i, (name, (_, most)) in enumerate(rivals.items()):
            bound = "-" if most is None else f"at most {most:.3g}"
            note(name, ratios[i], bound, medians[-1], medians[i])
        return medians[-1]

    return run
