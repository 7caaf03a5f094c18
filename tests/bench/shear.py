"""`make shear`: how much more is decided rightly with shear than without.

The paper guesses that shear may allow faster decisions (section IV-C). Each seed
simulates the paper's objects with a skin of three axes; all choices are made with the
features of shear among the candidates, and without them, on the same trials. Gains are
means over the seeds, with the 95 % interval of the mean (Student's t).
"""

from itertools import product
from pathlib import Path

import numpy as np
from scipy.stats import sem, t

from tests.bench import tables
from tests.bench.program import start
from train.data.dataset import read
from train.report.work import Workers
from train.simulate import run, scene
from train.tradeoff.choices import chosen, followed, unseen
from train.tradeoff.costs import without_shear

SCENE = tables.SCENES / "cody18_shear.toml"
SHOWN_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
"""Windows of the table of gains."""
KINDS = {"known objects": lambda choice: choice.by_trial, "unseen objects": unseen}
"""{kind: the accuracy of a choice on it}."""


def compared(seed, folder):
    """The choices with shear at each window on the trials of one seed, then those
    without."""
    data = folder / str(seed)
    run.write(scene.load(SCENE, seed=seed), data)
    dataset = followed(read([str(data)]))
    cases = product((dataset, without_shear(dataset)), SHOWN_S)
    return Workers(2).map(data.name, chosen, list(cases))


def gain(pairs, task, result_of):
    """The mean of the paired differences in points, with its 95 % interval."""
    differences = []
    for pair in pairs:
        after, before = (np.mean(result_of(choices[task]).hits) for choices in pair)
        differences.append(100.0 * (after - before))
    mean = np.mean(differences)
    reach = t.ppf(0.975, len(differences) - 1) * sem(differences)
    return f"{mean:+.1f} ({mean - reach:+.1f} to {mean + reach:+.1f})"


def gains(runs):
    """The points gained at each window."""
    rows = []
    for task, choice in runs[0][0].items():
        for kind, result_of in KINDS.items():
            if result_of(choice):
                row = {"points gained": f"{task}, {kind}"}
                for i, window in enumerate(SHOWN_S):
                    pairs = [choices[i :: len(SHOWN_S)] for choices in runs]
                    row[f"{window:g} s"] = gain(pairs, task, result_of)
                rows.append(row)
    return rows


def measure(seeds, out):
    """Measure, and write the table."""
    first = scene.load(SCENE).seed
    runs = [compared(first + i, out) for i in range(seeds)]
    tables.write("shear", [gains(runs)], "make shear")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--seeds", 5, "data sets"),
        ("--out", Path("build/shear"), "folder"),
    )
