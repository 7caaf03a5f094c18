"""`make shear`: how much sooner a task is decided with shear than without.

The paper guesses that shear may allow faster decisions (section IV-C). Each seed
simulates the paper's objects with a skin of three axes; all choices are made with the
features of shear among the candidates, and without them, on the same trials. Gains are
means over the seeds, with the 95 % interval of the mean (Student's t).
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from edge.cli import dispatch
from edge.commands.options import within
from tests.bench import tables
from train.dataset import read
from train.report.figures import STROKES, legend, picture
from train.report.work import Workers
from train.simulate import run, scene
from train.tradeoff import shear
from train.tradeoff.choices import WINDOWS_S, followed

SCENE = tables.ROOT / "train" / "scenes" / "cody18_shear.toml"
SHOWN_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
"""Windows of the table of gains."""
PICTURE = tables.ROOT / "docs" / "shear.png"
PICTURED = "mobility"
SIDES = {"without s": "plain", "with s": "sheared"}
"""{column: the answers that it holds}."""
Runs = Sequence[shear.Compared]


def compared(seed: int, folder: Path, jobs: int) -> shear.Compared:
    """The answers with shear and without on the trials of one seed."""
    loaded = scene.load(SCENE, seed=seed)
    data = folder / str(seed)
    run.write(loaded, data, jobs=jobs)
    dataset = followed(read([str(data)]))
    workers = Workers(jobs)
    sheared = shear.answers(dataset, WINDOWS_S, workers)
    return shear.compared(dataset, sheared, workers)


def mean_reached_s(runs: Runs, kind: str, task: str, level: float) -> dict[str, str]:
    """The first window from which on the mean accuracy of the seeds keeps a level."""
    cells = {}
    for name, side in SIDES.items():
        points = [getattr(pair, side).points for pair in runs]
        first = None
        for window in WINDOWS_S:
            shares = [shear.share(point[window][task], kind) for point in points]
            known = [value for value in shares if value is not None]
            if not known or float(np.mean(known)) < level:
                first = None
            elif first is None:
                first = window
        cells[name] = shear.seconds(first)
    return cells


def mean_early_s(runs: Runs, task: str, level: float) -> dict[str, str]:
    """The mean over the seeds of the time of early decisions; a dash where a seed never
    reaches the level."""
    cells = {}
    for name, side in SIDES.items():
        times = [shear.early_s(getattr(pair, side), task, level) for pair in runs]
        reached = [time for time in times if time is not None]
        complete = len(reached) == len(times)
        cells[name] = shear.seconds(float(np.mean(reached)) if complete else None)
    return cells


def times(runs: Runs) -> list[dict[str, object]]:
    """The time to each level, for each task and kind of decision."""
    rows: list[dict[str, object]] = []
    for task in runs[0].tasks:
        for level in shear.LEVELS:
            start = {"task": task, "right": f"{level:.0%}"}
            for kind in (shear.KNOWN, shear.UNMET):
                cells = mean_reached_s(runs, kind, task, level)
                rows.append({**start, "decision": f"fixed, {kind}", **cells})
            cells = mean_early_s(runs, task, level)
            rows.append({**start, "decision": f"early, {shear.KNOWN}", **cells})
    return rows


def gain(runs: Runs, task: str, window: float, kind: str) -> str:
    """The mean of the paired differences in points, with its 95 % interval."""
    differences = []
    for pair in runs:
        before = shear.share(pair.plain.points[window][task], kind)
        after = shear.share(pair.sheared.points[window][task], kind)
        if before is not None and after is not None:
            differences.append(100.0 * (after - before))
    if not differences:
        return ""
    mean = float(np.mean(differences))
    error = float(np.std(differences, ddof=1)) / len(differences) ** 0.5
    reach = float(stats.t.ppf(0.975, len(differences) - 1)) * error
    return f"{mean:+.1f} ({mean - reach:+.1f} to {mean + reach:+.1f})"


def gains(runs: Runs) -> list[dict[str, object]]:
    """The points gained at each window."""
    rows: list[dict[str, object]] = []
    for task in runs[0].tasks:
        for kind in (shear.KNOWN, shear.UNMET):
            cells = {f"{w:g} s": gain(runs, task, w, kind) for w in SHOWN_S}
            if any(cells.values()):
                rows.append({"points gained": f"{task}, {kind}", **cells})
    return rows


def mean_curve(runs: Runs, side: str, kind: str) -> Mapping[float, float]:
    """{window: mean accuracy of the seeds in percent} of the task that is drawn."""
    means = {}
    for window in WINDOWS_S:
        shares = [
            shear.share(getattr(pair, side).points[window][PICTURED], kind)
            for pair in runs
        ]
        means[window] = 100.0 * float(np.mean([s for s in shares if s is not None]))
    return means


def draw(runs: Runs) -> bytes:
    """The picture of README: mobility against time."""

    def paint(canvas: Any, phone: bool) -> None:
        axes = canvas.subplots()
        for number, (name, side) in enumerate(
            (("with shear", "sheared"), ("without", "plain"))
        ):
            colour, marker, _ = STROKES[number]
            for kind, dashes in ((shear.KNOWN, "-"), (shear.UNMET, ":")):
                means = mean_curve(runs, side, kind)
                style = {"color": colour, "marker": marker, "ms": 4, "ls": dashes}
                label = f"{name}, {kind}"
                axes.plot(list(means), list(means.values()), label=label, **style)
        axes.set(xlabel="seconds from first contact", ylim=(40, 103))
        axes.set_ylabel(f"right about {PICTURED}, %")
        legend(canvas, axes, 2)

    return picture("shear", "Mobility with shear and without", paint, (3.4, 3.4)).png


def measure(arguments: argparse.Namespace) -> int:
    """Measure, and write the tables and the picture."""
    first = scene.load(SCENE).seed
    runs = []
    for seed in range(first, first + arguments.seeds):
        print(f"seed {seed}", flush=True)
        runs.append(compared(seed, arguments.out, arguments.jobs))
    reached = [row for row in times(runs) if {"-"} != {row[key] for key in SIDES}]
    tables.write("shear", [reached, gains(runs)], "make shear")
    PICTURE.write_bytes(draw(runs))
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="tests.bench.shear", description=__doc__)
    count = within(int, 1, 1000)
    top.add_argument("--seeds", type=count, default=5, help="data sets (%(default)s)")
    top.add_argument("--jobs", type=count, default=2, help="processes (%(default)s)")
    top.add_argument("--out", type=Path, default=Path("build/shear"))
    top.set_defaults(run=measure)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
