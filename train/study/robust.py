"""The cost of another speed, arm or sensor, for simulated data sets."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from edge.errors import InputError
from edge.touch.contact import FeatureSeries
from train.dataset import DataSet
from train.report import figures
from train.report.score import grid_search, score, transfer
from train.report.section import Section, Table
from train.report.skins import follow, vectors
from train.simulate.engine import run_physics
from train.simulate.run import batches_of, file_name, recordings
from train.simulate.scene_model import Scene
from train.simulate.schema import EFFECTS
from train.study.context import Context

FACTORS = (0.5, 2.0)
SENSOR = tuple(name for name, info in EFFECTS.items() if info.stage in ("sensor", "clock"))
"""Effects that change what is read, never what happens."""
HOW = "trained and tested with it", "trained without it, tested with it"


def variants(scene: Scene) -> dict[str, Scene]:
    """{name: the scene with one thing changed}: the speed, the arm, or an effect of the sensor."""
    changed = {}
    for factor in FACTORS:
        # The equilibrium point travels the same distance.
        rate, stiffness = (tuple(factor * x for x in xs) for xs in (scene.rate, scene.stiffness))
        faster = replace(scene, rate=rate, travel_s=scene.travel_s / factor)
        changed[f"speed x {factor:g}"] = faster
        changed[f"arm stiffness x {factor:g}"] = replace(scene, stiffness=stiffness)
    for name in SENSOR:
        others = tuple(effect for effect in scene.add if effect != name)
        if name in scene.add:
            changed[f"without {name}"] = replace(scene, add=others)
        else:
            changed[f"with {name}"] = replace(scene, add=(*others, name))
    return changed


def anew(scene: Scene, data: DataSet) -> list[FeatureSeries | None]:
    """The contacts of a data set's trials, in its order, simulated again from a scene.

    A trial has the same random draws in every scene, those with which it met its label when it was
    recorded. A weaker arm that no longer moves an object does not change its label. A trial that
    the scene does not have counts as one without contact.
    """
    attempts = {
        trial.path.name: trial.recording.meta.get("simulation", {}).get("redrawn", 0)
        for trial in data.trials
    }
    specs = tuple(
        replace(spec, attempt=int(attempts.get(file_name(scene, spec), 0)))
        for batch in batches_of(scene)
        for spec in batch
    )
    files, sensed = zip(*recordings(run_physics(scene, specs)), strict=True)
    contacts = dict(zip(files, follow(sensed, data.layout, data.tracking, data.chain), strict=True))
    return [contacts.get(file) for file in attempts]


def section(context: Context) -> Section | None:
    """Accuracy with each change; None where the data set was not simulated here."""
    scene = context.scene
    if scene is None:
        return None
    changes, X, y = variants(scene), context.vectors(), context.labels
    again = [(changed, context.dataset) for changed in (scene, *changes.values())]
    unchanged, *series = context.workers.map("simulated again", anew, again)
    if not np.array_equal(vectors(unchanged), X):
        raise InputError(
            f"the scene {scene.name} gives other trials than these recordings; give the scene that "
            "they were simulated from, simulate it again, or study them without a scene"
        )
    changed = [vectors(contacts) for contacts in series]
    plain = grid_search(X, y)
    retrained = context.workers.map("their accuracy", grid_search, [(x, y) for x in changed])
    transferred = context.workers.map("trained here", transfer, [(X, y, plain, x) for x in changed])
    results = dict(zip(HOW, (retrained, transferred), strict=True))
    rows = [
        {"change": name, "task": task, "trained and tested": how, **score(result)}
        | {"without contact": series[i].count(None)}
        for i, name in enumerate(changes)
        for how, answers in results.items()
        for task, result in answers[i].items()
    ]
    pictures = [
        figures.bars(
            f"robustness_{task}",
            f"{task}: accuracy after a change",
            list(changes),
            {how: [answer[task] for answer in answers] for how, answers in results.items()},
            reference={f"no change, {plain[task].accuracy:.0%}": 100 * plain[task].accuracy},
        )
        for task in y
    ]
    title = "Another speed, arm or sensor; trained with it or without it"
    return Section(
        "Another speed, another arm, each effect of the sensor",
        [
            "Each row simulates the scene again with one thing changed and the same random draws: "
            "the equilibrium point's speed (over the same distance), all joint stiffnesses, and "
            "each effect of the sensor at its default size, added or, where the scene has it, left "
            "out.",
            "The first bar is trained with the change, the second meets it for the first time. The "
            "gap between them is the cost for a robot that was not trained for the change. The "
            "unchanged version of a test trial is never in the training set.",
        ],
        [Table("robustness", title, rows)],
        pictures,
    )
