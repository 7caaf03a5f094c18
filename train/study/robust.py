"""The cost of another speed, arm or sensor, for simulated data sets."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from edge.config import ConfigTable
from edge.errors import InputError
from edge.touch.contact import FeatureSeries
from train.choose.evaluate import Result
from train.data.contacts import Trial
from train.data.dataset import DataSet
from train.report import figures
from train.report.score import grid_search, score, transfer
from train.report.section import Figure, Row, Section, Table
from train.report.skins import follow, vectors
from train.simulate.engine import run_physics
from train.simulate.run import batches_of, file_name, recordings
from train.simulate.scene_model import Scene
from train.simulate.schema import EFFECTS
from train.simulate.truth import REDRAWS
from train.study.context import Context

FACTORS = (0.5, 2.0)
SENSOR_EFFECTS = tuple(
    name for name, info in EFFECTS.items() if info.stage in ("sensor", "clock")
)
"""Effects that change the readings and leave the contact as it is."""
TRAINING = "trained with the change", "trained without it"


def variants(scene: Scene) -> dict[str, Scene]:
    """{name: the scene with one thing changed}: the speed, the arm, or an effect of the
    sensor."""
    changed = {}
    for factor in FACTORS:
        rate = tuple(factor * x for x in scene.rate)
        stiffness = tuple(factor * x for x in scene.stiffness)
        # The equilibrium point travels the same distance.
        faster = replace(scene, rate=rate, travel_s=scene.travel_s / factor)
        changed[f"speed x {factor:g}"] = faster
        changed[f"arm stiffness x {factor:g}"] = replace(scene, stiffness=stiffness)
    for name in SENSOR_EFFECTS:
        effects = tuple(effect for effect in scene.add if effect != name)
        if name in scene.add:
            changed[f"without {name}"] = replace(scene, add=effects)
        else:
            changed[f"with {name}"] = replace(scene, add=(*effects, name))
    return changed


def attempt_of(trial: Trial) -> int:
    """How often a trial was drawn again until it fitted its label; 0 where the file has
    no count.

    Raises:
        InputError: `meta.simulation` is damaged; the sentence names the file.
    """
    simulation = trial.recording.meta.get("simulation", {})
    table = ConfigTable(simulation, str(trial.path), "meta.simulation.")
    return table.whole("redrawn", 0, range(REDRAWS))


def simulated_again(scene: Scene, data: DataSet) -> list[FeatureSeries | None]:
    """The contacts of a data set's trials, in its order, simulated again from a scene.

    A trial has the same random draws in every scene: those with which it fitted its
    label when it was recorded. A weaker arm that no longer moves an object does not
    change its label. A trial that the scene does not have counts as one without
    contact.

    Raises:
        InputError: `meta.simulation` of a trial is damaged.
    """
    attempts = {trial.path.name: attempt_of(trial) for trial in data.trials}
    specs = tuple(
        replace(spec, attempt=attempts.get(file_name(scene, spec), 0))
        for batch in batches_of(scene)
        for spec in batch
    )
    files, sensed = zip(*recordings(run_physics(scene, specs)), strict=True)
    contacts = dict(zip(files, follow(sensed, data.layout, data.chain), strict=True))
    return [contacts.get(file) for file in attempts]


def _bars(
    task: str,
    changes: Iterable[str],
    results: Mapping[str, Sequence[Mapping[str, Result]]],
    plain: float,
) -> Figure:
    """The picture of a task's accuracy after each change.

    Args:
        task: the task.
        changes: their names.
        results: {training: {task: result} for each change}.
        plain: the task's accuracy without a change.
    """
    return figures.bars(
        f"robustness_{task}",
        f"{task}: accuracy after a change",
        list(changes),
        {
            training: [answer[task] for answer in answers]
            for training, answers in results.items()
        },
        reference={f"no change, {plain:.0%}": 100 * plain},
    )


def section(context: Context) -> Section | None:
    """Accuracy with each change; None where the data set was not simulated here."""
    scene = context.scene
    if scene is None:
        return None
    changes = variants(scene)
    X = context.vectors()
    y = context.labels
    cases = [(changed, context.dataset) for changed in (scene, *changes.values())]
    unchanged, *series = context.workers.map("simulated again", simulated_again, cases)
    if not np.array_equal(vectors(unchanged), X):
        raise InputError(
            f"the scene {scene.name} gives other trials than these recordings; give "
            "the scene that they were simulated from, simulate it again, or study them "
            "without a scene"
        )
    changed = list(map(vectors, series))
    plain = grid_search(X, y)
    work = context.workers.map
    retrained = work("trained with", grid_search, [(x, y) for x in changed])
    kept = work("trained without", transfer, [(X, y, plain, x) for x in changed])
    results = dict(zip(TRAINING, (retrained, kept), strict=True))
    rows: list[Row] = []
    for i, name in enumerate(changes):
        for training, answers in results.items():
            for task, result in answers[i].items():
                row: Row = {"change": name, "task": task, "training": training}
                row |= score(result)
                row["without contact"] = series[i].count(None)
                rows.append(row)
    pictures = [_bars(task, changes, results, plain[task].accuracy) for task in y]
    return Section(
        "Another speed, arm or sensor",
        [
            "Each row simulates the scene again with one change and the same random "
            "draws. The changes are half and twice the speed of the equilibrium point "
            "over the same distance, half and twice the stiffness of all joints, and "
            "each effect of the sensor at its default size. An effect that the scene "
            "has is left out instead.",
            "All tests are on changed trials. The first bar is a classifier that was "
            "trained on changed trials too; the second was trained on the trials as "
            "they were recorded. The gap between them is the cost for a robot that was "
            "not trained for the change. The unchanged version of a test trial is "
            "never in the training set.",
        ],
        [Table("robustness", "Accuracy after each change", rows)],
        pictures,
    )
