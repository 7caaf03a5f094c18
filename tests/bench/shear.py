"""`make shear`: how much more is decided rightly with shear than without.

The paper guesses that shear may allow faster decisions (section IV-C). Each seed
simulates the paper's objects with a skin of three axes; all choices are made with the
features of shear among the candidates, and without them, on the same trials. Gains are
means over the seeds, with the 95 % interval of the mean (Student's t).
"""

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
    run.write(scene.load(SCENE, seed=seed), data)
    dataset = followed(read([str(data)]))
    return shear.compared(dataset, WINDOWS_S, Workers(jobs))


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
        for kind in (shear.KNOWN, shear.UNSEEN):
            cells = {f"{w:g} s": gain(runs, task, w, kind) for w in SHOWN_S}
            if any(cells.values()):
                rows.append({"points gained": f"{task}, {kind}", **cells})
    return rows


def measure(seeds, jobs, out):
    """Measure, and write the table."""
    first = scene.load(SCENE).seed
    runs = []
    for seed in range(first, first + seeds):
        print(f"seed {seed}", flush=True)
        runs.append(compared(seed, out, jobs))
    tables.write("shear", [gains(runs)], "make shear")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--seeds", 5, "data sets"),
        ("--jobs", 2, "processes"),
        ("--out", Path("build/shear"), "folder"),
    )
