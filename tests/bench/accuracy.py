"""`make accuracy`: the accuracies that an export prints, on simulated and on real sets.

Each set is fitted as `make export` would fit it. The accuracies are nested: of the
whole choice, on trials that took no part in it, with the interval of the exported model
on other trials, or on other objects or kinds where entire groups are left out.
"""

import tempfile
from pathlib import Path

import train
from tests.bench import tables
from tests.bench.program import start
from train.__main__ import main as train_command
from train.progress import bar


def recorded(folder, grasps):
    """Sets of recordings, which are simulated or imported into a folder: name, folder,
    options of the fit."""
    for scene in ("cody18", "household"):
        out = folder / scene
        path = tables.SCENES / f"{scene}.toml"
        train_command(["simulate", str(path), "--out", str(out)])
        yield f"`{scene}`, simulated", out, {}
    if grasps:
        out = folder / "sdh2"
        train_command(["import", "sdh2", grasps, "--out", str(out)])
        touch = {"features": ["moments"], "projection": "lda"}
        yield "SDH-2 grasps, by touch alone", out, touch
        yield "SDH-2 grasps, with joint angles, which leak", out, {}


def accuracies(name, folder, options):
    """A row for each task of a set of recordings."""
    fitted = train.fit(folder, **options)
    dataset = fitted.dataset
    for task, chosen in fitted.chosen.items():
        low, high = chosen.accuracy.interval
        yield {
            "recordings": name,
            "trials": len(dataset.trials),
            "task": task,
            "labels": len(set(dataset.labels(task))),
            "left out": chosen.left_out,
            "accuracy": f"{chosen.accuracy.accuracy:.0%}",
            "95 % interval": f"{low:.0%} to {high:.0%}",
        }


def measure(grasps):
    """Fit the sets, print and write the table."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        sets = list(recorded(Path(name), grasps))
        for label, recordings, options in bar(sets, desc="sets"):
            rows += accuracies(label, recordings, options)
    tables.write("accuracy", [rows])


if __name__ == "__main__":
    start(measure, __doc__, ("--grasps", "", "folder of the published SDH-2 grasps"))
