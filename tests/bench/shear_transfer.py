"""`make shear-transfer`: do features of shear hold in another physics engine?

Two models are fitted on `household_shear`, with the default features of such a scene
and with those of shear besides. Both are scored on the same touches of MuJoCo, whose
tangential forces are those of its own contacts.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from itertools import cycle, islice
from pathlib import Path

from joblib import Parallel, cpu_count, delayed

from edge.cli import dispatch
from edge.commands.options import within
from edge.model.model import Model
from edge.tools.replay import Summary, decide
from export.api import save
from tests.bench import tables
from tests.bench.transfer import HABITS, TASKS, touch_object
from train.fitting import fit
from train.progress import bar
from train.simulate import run, scene

SCENE = tables.ROOT / "train" / "scenes" / "household_shear.toml"
CHOICES = {
    "without shear": ["contact", "joints"],
    "with shear": ["contact", "joints", "shear"],
}


def models(out: Path, jobs: int) -> dict[str, Model]:
    """The two models, fitted on the same simulated touches."""
    data = out / "simulated"
    run.write(scene.load(SCENE), data, jobs=jobs)
    fitted = {}
    for name, features in CHOICES.items():
        path = out / f"{name.replace(' ', '-')}.onnx"
        save(path, fit(str(data), features=features, jobs=jobs))
        fitted[name] = Model(path)
    return fitted


def measure(arguments: argparse.Namespace) -> int:
    """Fit, simulate the other engine's touches, and write the table."""
    arguments.out.mkdir(parents=True, exist_ok=True)
    both = models(arguments.out, arguments.jobs)
    habits = list(islice(cycle(HABITS), arguments.trials // 2))
    rows = []
    for seed in range(1, arguments.seeds + 1):
        touches = Parallel(n_jobs=cpu_count(), return_as="generator")(
            delayed(touch_object)(i, seed, habit) for i, habit in enumerate(habits)
        )
        shown = bar(touches, total=len(habits), unit=" objects", desc="MuJoCo")
        recordings = [recording for pair in shown for recording in pair]
        for name, model in both.items():
            tasks = {t: task for t, task in model.info.tasks.items() if t in TASKS}
            summary = Summary(tasks)
            for number, recording in enumerate(recordings):
                events = decide(model, recording, f"touch {number}")
                summary.add(recording.labels, events)
            row: dict[str, object] = {"MuJoCo seed": seed, "features": name}
            row["trials"] = summary.recordings
            for task in tasks:
                right, count = summary.right(task)
                row[f"{task} right, %"] = f"{100.0 * right / count:.1f}"
            rows.append(row)
    tables.write("shear_transfer", [rows], "make shear-transfer")
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(
        prog="tests.bench.shear_transfer", description=__doc__.split("\n\n")[0]
    )
    count = within(int, 1, 1000)
    top.add_argument("--seeds", type=count, default=3, help="test sets (%(default)s)")
    top.add_argument("--trials", type=count, default=96, help="of each (%(default)s)")
    top.add_argument("--jobs", type=count, default=2, help="processes (%(default)s)")
    top.add_argument("--out", type=Path, default=Path("build/shear_transfer"))
    top.set_defaults(run=measure)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
