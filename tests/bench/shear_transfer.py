"""`make shear-transfer`: do features of shear hold in another physics engine?

Two models are fitted on `household_shear`, with the default features of such a scene
and with those of shear besides. Both are scored on the same touches of MuJoCo, whose
tangential forces are those of its own contacts.
"""

from pathlib import Path

from edge.model.model import Model
from edge.tools.replay import Summary, decide
from export.api import save
from tests.bench import tables
from tests.bench.program import start
from tests.bench.transfer import judged_tasks, touches
from train.fitting import fit
from train.simulate import run, scene

SCENE = tables.SCENES / "household_shear.toml"
CHOICES = {
    "without shear": ["contact", "joints"],
    "with shear": ["contact", "joints", "shear"],
}


def measure(seeds, trials, jobs, out):
    """Fit, simulate the other engine's touches, and write the table."""
    data = out / "simulated"
    run.write(scene.load(SCENE), data, jobs=jobs)
    models = {}
    for name, features in CHOICES.items():
        path = out / f"{name.replace(' ', '-')}.onnx"
        save(path, fit(str(data), features=features, jobs=jobs))
        models[name] = Model(path)
    rows = []
    for seed in range(1, seeds + 1):
        recordings = [recording for _, _, recording in touches(seed, trials)]
        for name, model in models.items():
            summary = Summary(judged_tasks(model))
            for number, recording in enumerate(recordings):
                events = decide(model, recording, f"touch {number}")
                summary.add(recording.labels, events)
            row = {"MuJoCo seed": seed, "features": name, "trials": len(recordings)}
            for task in judged_tasks(model):
                right, count = summary.right(task)
                row[f"{task} right, %"] = f"{100.0 * right / count:.1f}"
            rows.append(row)
    tables.write("shear_transfer", [rows], "make shear-transfer")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--seeds", 3, "test sets"),
        ("--trials", 96, "of each"),
        ("--jobs", 2, "processes"),
        ("--out", Path("build/shear_transfer"), "folder"),
    )
