"""The cost of another speed, arm or sensor, for simulated data sets."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.track import TrackSettings
from train.report import figures
from train.report.score import grid_search, score, transfer
from train.report.section import Section, Table
from train.report.skins import follow, vectors
from train.simulate.engine import run_physics
from train.simulate.run import batches_of, file_name, recordings
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import EFFECTS
from train.study.context import Context

FACTORS = (0.5, 2.0)
SENSOR = tuple(name for name, info in EFFECTS.items() if info.stage in ("sensor", "clock"))
"""Effects that change what is read, never what happens."""
UNCHANGED = "as recorded"
HOW = "trained and tested with it", "trained without it, tested with it"
BATCHES = 2
"""Parts of a scene that are simulated anew one by one; more cost more time in all."""


def variants(scene: Scene) -> list[dict[str, Scene]]:
    """{name: the scene with one thing changed}; all changes of the sensor are the last group."""
    changed: dict[str, Scene] = {}
    for factor in FACTORS:
        # The equilibrium point travels the same distance.
        changed[f"speed x {factor:g}"] = replace(
            scene, rate=tuple(r * factor for r in scene.rate), travel_s=scene.travel_s / factor
        )
        changed[f"arm stiffness x {factor:g}"] = replace(
            scene, stiffness=tuple(k * factor for k in scene.stiffness)
        )
    sensor: dict[str, Scene] = {}
    for name in SENSOR:
        if name in scene.add:
            others = tuple(effect for effect in scene.add if effect != name)
            sensor[f"without {name}"] = replace(scene, add=others)
        else:
            sensor[f"with {name}"] = replace(scene, add=(*scene.add, name))
    return [*({name: changed[name]} for name in changed), sensor]


def measured(
    scenes: Mapping[str, Scene],
    trials: tuple[TrialSpec, ...],
    wanted: Collection[str],
    layout: SkinLayout,
    tracking: TrackSettings,
    chain: Chain | None,
) -> dict[str, dict[str, FeatureSeries | None]]:
    """{name: {file name: contact or None}} of some trials, as each scene's sensor shows them.

    Args:
        scenes: {name: scene} that differ in their sensor alone.
        trials: as they were drawn.
        wanted: file names of the trials to follow.
        layout: the skin, with its thresholds.
        tracking: how contacts are followed.
        chain: the arm, or None.
    """
    # Without any effect of the sensor, frames would be kept in whole counts.
    physics = run_physics(max(scenes.values(), key=lambda scene: len(scene.add)), trials)
    contacts: dict[str, dict[str, FeatureSeries | None]] = {}
    for name, scene in scenes.items():
        sensed = recordings(physics, scene=scene)
        kept = {file: recording for file, recording in sensed if file in wanted}
        followed = follow(list(kept.values()), layout, tracking, chain)
        contacts[name] = dict(zip(kept, followed, strict=True))
    return contacts


def anew(
    context: Context, groups: Sequence[Mapping[str, Scene]]
) -> dict[str, list[FeatureSeries | None]]:
    """{name: contacts of the data set's trials, in its order, simulated again from each scene}.

    The scenes of a group differ in their sensor alone, so that they share one simulation.

    A trial has the same random draws in every scene, those with which it met its label when it was
    recorded. A weaker arm that no longer moves an object does not change its label.

    Raises:
        InputError: a scene has no trial of a recording's name.
    """
    data = context.dataset
    wanted = [trial.path.name for trial in data.trials]
    redrawn = {
        file: int(recording.meta.get("simulation", {}).get("redrawn", 0))
        for file, recording in zip(wanted, context.recordings, strict=True)
    }
    cases = []
    for group in groups:
        shown = next(iter(group.values()))
        for trials in batches_of(shown, jobs=BATCHES):
            drawn = tuple(replace(t, attempt=redrawn.get(file_name(shown, t), 0)) for t in trials)
            cases.append((group, drawn, set(wanted), data.layout, data.tracking, data.chain))
    merged: dict[str, dict[str, FeatureSeries | None]] = {n: {} for group in groups for n in group}
    for answer in context.workers.map("simulated again", measured, cases):
        for name, contacts in answer.items():
            merged[name] |= contacts
    strange = [file for file in wanted if any(file not in contacts for contacts in merged.values())]
    if strange:
        raise InputError(
            f"{strange[0]}: the scene has no such trial; give the scene that the recordings were "
            "simulated from, or no scene"
        )
    return {name: [contacts[file] for file in wanted] for name, contacts in merged.items()}


def section(context: Context) -> Section | None:
    """Accuracy with each change; None where the data set was not simulated here."""
    scene = context.scene
    if scene is None:
        return None
    series = anew(context, [{UNCHANGED: scene}, *variants(scene)])
    X, y = context.vectors(), context.labels
    if not np.array_equal(vectors(series.pop(UNCHANGED)), X):
        raise InputError(
            f"the scene {scene.name} gives other trials than these recordings; simulate it again, "
            "or study them without a scene"
        )
    changed = [vectors(contacts) for contacts in series.values()]
    retrained = context.workers.map("their accuracy", grid_search, [(x, y) for x in changed])
    plain = grid_search(X, y)
    transferred = context.workers.map("trained here", transfer, [(X, y, plain, x) for x in changed])
    rows = [
        {"change": name, "task": task, "trained and tested": how, **score(result)}
        | {"without contact": sum(contact is None for contact in series[name])}
        for name, *sets in zip(series, retrained, transferred, strict=True)
        for how, results in zip(HOW, sets, strict=True)
        for task, result in results.items()
    ]
    pictures = [
        figures.bars(
            f"robustness_{task}",
            f"{task}: accuracy after a change",
            list(series),
            {
                how: [result[task] for result in results]
                for how, results in zip(HOW, (retrained, transferred), strict=True)
            },
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
