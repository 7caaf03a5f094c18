"""`make flags`: are answers with a flag more often wrong than those without it?

A flag earns its place where they are, and where those with no other flag are more often
wrong than those without any. A row has the shares of the answers of a domain that are
wrong. Those without the flag are of the same tasks, and all are of tasks whose labels
the model knows. A name that is withheld counts as that which the model would give. The
domains:

- "fresh": fresh touches of `cody18`, decided by its full export.
- "objects left out": the same by a full export without four of the 18 objects.
- "shifts": the fresh touches changed as `make shifts` does.
- "another engine": those of `make transfer`, decided by a full export of `household`.
- a folder of real recordings: one half, decided by a full export of the other.

With "--error" decisions come early: a rate of 0.1 is asked for.
"""

import tempfile
from itertools import chain
from pathlib import Path

from edge.decide.flags import FLAGS
from tests.checks.bench import tables, transfer
from tests.checks.bench.program import start
from tests.checks.bench.risk import without_objects
from tests.checks.bench.shifts import (
    FRESH_SEED,
    SCENE,
    STRANGE,
    cases,
    decisions,
    exported,
    share,
)
from tests.checks.remount import halves
from train.simulate import scene as scenes
from train.simulate.run import write

ERROR = 0.1


def of_scene(path):
    """The model of a full export of a scene's trials."""
    with tempfile.TemporaryDirectory() as folder:
        write(scenes.load(path), folder)
        return exported(folder)


def domains(recordings, count):
    """(domain, model, touches, error asked for) of each."""
    shifts = cases(scenes.load(SCENE, seed=FRESH_SEED, count=count))
    _, fresh = next(shifts)
    model = of_scene(SCENE)
    yield "fresh", model, fresh, None
    yield "fresh, --error", model, fresh, ERROR
    yield "objects left out", without_objects(0)[0], fresh, None
    shifted = chain.from_iterable(touches for _, touches in shifts)
    yield "shifts", model, shifted, None
    of_mujoco = (touch for _, touch in transfer.touches(1))
    yield "another engine", of_scene(STRANGE), of_mujoco, None
    for folder in recordings:
        yield Path(folder).name, *halves(folder), None


def met(model, rows):
    """The rows of tasks whose labels the model knows."""
    tasks = model.info.tasks.items()
    known = {(task, label) for task, of_task in tasks for label in of_task.labels}
    shared = known.intersection(zip(rows["task"], rows["truth"], strict=True))
    return rows[rows["task"].isin([task for task, _ in shared])]


def flagged(domain, rows):
    """A row for each flag that answers of a domain have, from its `decisions`."""
    named = [decision and decision.label for decision in rows["decision"]]
    wrong = named != rows["truth"]
    count = rows["flags"].map(len)
    for flag in FLAGS:
        has = rows["flags"].map(lambda flags, flag=flag: flag in flags)
        if has.any():
            alike = rows["task"].isin(rows["task"][has])
            alone = has & (count == 1)
            yield {
                "flag": flag,
                "domain": domain,
                "answers with it": has.sum(),
                "wrong": f"{share(wrong[has]):.1%}",
                "wrong without it": f"{share(wrong[alike & ~has]):.1%}",
                "answers with it alone": alone.sum(),
                "of these wrong": f"{share(wrong[alone]):.1%}",
                "wrong without any": f"{share(wrong[alike & (count == 0)]):.1%}",
            }


def measure(recordings, count):
    """Measure, and write the table."""
    rows = []
    for domain, model, touches, error in domains(recordings, count):
        rows += flagged(domain, met(model, decisions(model, touches, error)))
    rows.sort(key=lambda row: list(FLAGS).index(row["flag"]))
    tables.write("flags", [rows], "make flags")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--recordings", [], "folders of real recordings"),
        ("--count", 5, "fresh touches of each object in each condition"),
    )
