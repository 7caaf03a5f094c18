"""`make shear`: how much sooner a task is decided with shear than without.

The paper guesses that shear may allow faster decisions (section IV-C). Each seed
simulates the paper's objects with a skin of three axes; all choices are made with the
features of shear among the candidates, and without them, on the same trials. Gains are
means over the seeds, with the 95 % interval of the mean (Student's t).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import sem, t

from tests.bench import tables
from tests.bench.program import start
from train.data.dataset import read
from train.report.work import Workers
from train.simulate import run, scene
from train.tradeoff import shear
from train.tradeoff.choices import WINDOWS_S, followed

SCENE = tables.SCENES / "cody18_shear.toml"
SHOWN_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
"""Windows of the table of gains."""


def compared(seed, folder, jobs):
    """The answers with shear and without on the trials of one seed."""
    data = folder / str(seed)
    run.write(scene.load(SCENE, seed=seed), data, jobs=jobs)
    dataset = followed(read([str(data)]))
    workers = Workers(jobs)
    sheared = shear.answers(dataset, WINDOWS_S, workers)
    return shear.compared(dataset, sheared, workers)


@dataclass(frozen=True)
class Mean:
    """The mean over the seeds of answers, which `train.tradeoff.shear` shows as those
    of one seed.

    Attributes:
        seeds: the answers of each.
    """

    seeds: Sequence[shear.Answers]

    @property
    def tasks(self):
        return self.seeds[0].tasks

    def shares(self, task, kind):
        """{window: mean accuracy}; None where no seed has one."""
        of_seeds = [answers.shares(task, kind) for answers in self.seeds]
        means = {}
        for window in WINDOWS_S:
            shares = [s[window] for s in of_seeds if s[window] is not None]
            means[window] = float(np.mean(shares)) if shares else None
        return means

    def early_s(self, task, kind, level):
        """The mean time of early decisions; None where a seed never reaches the
        level."""
        times = [answers.early_s(task, kind, level) for answers in self.seeds]
        return None if None in times else float(np.mean(times))


def gain(runs, task, window, kind):
    """The mean of the paired differences in points, with its 95 % interval."""
    differences = []
    for pair in runs:
        before = pair.plain.shares(task, kind)[window]
        after = pair.sheared.shares(task, kind)[window]
        if before is not None and after is not None:
            differences.append(100.0 * (after - before))
    if not differences:
        return ""
    mean = np.mean(differences)
    reach = t.ppf(0.975, len(differences) - 1) * sem(differences)
    return f"{mean:+.1f} ({mean - reach:+.1f} to {mean + reach:+.1f})"


def gains(runs):
    """The points gained at each window."""
    rows = []
    for task in runs[0].plain.tasks:
        for kind in (shear.KNOWN, shear.UNMET):
            cells = {f"{w:g} s": gain(runs, task, w, kind) for w in SHOWN_S}
            if any(cells.values()):
                rows.append({"points gained": f"{task}, {kind}", **cells})
    return rows


def measure(seeds, jobs, out):
    """Measure, and write the tables."""
    first = scene.load(SCENE).seed
    runs = []
    for seed in range(first, first + seeds):
        print(f"seed {seed}", flush=True)
        runs.append(compared(seed, out, jobs))
    means = shear.Compared(
        Mean([pair.sheared for pair in runs]), Mean([pair.plain for pair in runs])
    )
    rows = shear.times(means)
    reached = [row for row in rows if {row["with s"], row["without s"]} != {"-"}]
    tables.write("shear", [reached, gains(runs)], "make shear")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--seeds", 5, "data sets"),
        ("--jobs", 2, "processes"),
        ("--out", Path("build/shear"), "folder"),
    )
