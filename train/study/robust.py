"""Simulated alone: another speed, another arm, and each effect of the sensor."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import replace

import numpy as np

from edge.errors import InputError
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from edge.touch.track import TrackSettings
from train.report import figures
from train.report.tables import SCORE, Figure, Section, Table, score
from train.simulate.assemble import make_plan
from train.simulate.engine import kind_of, run_physics
from train.simulate.run import file_name, parts, recordings
from train.simulate.scene_model import Scene, TrialSpec
from train.simulate.schema import EFFECTS
from train.study.context import Context
from train.study.score import grid_search, transfer
from train.study.skins import follow, vectors

FACTORS = (0.5, 2.0)
SENSOR = tuple(name for name, info in EFFECTS.items() if info.stage in ("sensor", "clock"))
"""Effects that change what is read, never what happens."""


UNCHANGED = "as recorded"


def variants(scene: Scene) -> dict[str, Scene]:
    """The scene with one thing changed."""
    found: dict[str, Scene] = {}
    for factor in FACTORS:
        # The equilibrium point covers the same way.
        faster = replace(
            scene, rate=tuple(r * factor for r in scene.rate), travel_s=scene.travel_s / factor
        )
        found[f"speed x {factor:g}"] = faster
        found[f"arm stiffness x {factor:g}"] = replace(
            scene, stiffness=tuple(k * factor for k in scene.stiffness)
        )
    for name in SENSOR:
        if name in scene.add:
            found[f"without {name}"] = replace(scene, add=tuple(e for e in scene.add if e != name))
        else:
            found[f"with {name}"] = replace(scene, add=(*scene.add, name))
    return found


def physics(scene: Scene) -> Scene:
    """The scene without its sensor's effects: scenes that share it share their physics."""
    return replace(scene, add=tuple(name for name in scene.add if name not in SENSOR))


def groups(scenes: Mapping[str, Scene]) -> list[list[str]]:
    """Names of scenes that differ in their sensor alone, a list for each physics.

    A sensor without any effect is no part of a group: its frames are kept in whole counts.
    """
    found: list[tuple[Scene, bool, list[str]]] = []
    for name, scene in scenes.items():
        bare = physics(scene)
        sensed = any(e in SENSOR and e not in scene.leave_out for e in scene.add)
        for other, alike, names in found:
            if alike and sensed and other == bare:
                names.append(name)
                break
        else:
            found.append((bare, sensed, [name]))
    return [names for _, _, names in found]


def measured(
    scenes: Mapping[str, Scene],
    trials: tuple[TrialSpec, ...],
    step_s: float,
    wanted: Collection[str],
    layout: SkinLayout,
    tracking: TrackSettings,
    chain: Chain | None,
) -> dict[str, dict[str, FeatureSeries | None]]:
    """The contacts of a batch's trials, as each of some scenes' sensors shows them.

    Args:
        scenes: {name: scene} that differ in their sensor alone.
        trials: of one kind, as they were drawn.
        step_s: of the physics.
        wanted: file names of the trials to follow.
        layout: the skin, with its thresholds.
        tracking: how contacts are followed.
        chain: the arm, or None.

    Returns:
        {name: {file name: contact, or None where there is none}}.
    """
    first = trials[0]
    plans = {
        name: make_plan(scene, kind_of(scene, first.object, first.condition).effects)
        for name, scene in scenes.items()
    }
    shown = next(iter(scenes))
    physics = run_physics(scenes[shown], trials, step_s, plan=plans[shown])
    found: dict[str, dict[str, FeatureSeries | None]] = {}
    for name, scene in scenes.items():
        shown_so = recordings(physics, plans[name], scene, step_s)
        kept = {file: recording for file, recording in shown_so if file in wanted}
        contacts = follow(list(kept.values()), layout, tracking, chain)
        found[name] = dict(zip(kept, contacts, strict=True))
    return found


def anew(context: Context, scenes: Mapping[str, Scene]) -> dict[str, list[FeatureSeries | None]]:
    """{name: the data set's trials, in its order, as simulated anew from each scene}.

    A trial is the same draw in every scene, the one that did as its label says when it was
    recorded: a slower or weaker arm that no longer moves it does not change what it is.

    Raises:
        InputError: a scene has no trial of a recording's name.
    """
    data = context.dataset
    wanted = [trial.path.name for trial in data.trials]
    redrawn = {
        file: int(recording.meta.get("simulation", {}).get("redrawn", 0))
        for file, recording in zip(wanted, context.recordings, strict=True)
    }
    alike = [{name: scenes[name] for name in names} for names in groups(scenes)]
    cases = []
    for group in alike:
        shown = next(iter(group.values()))
        for trials, step_s in parts(shown):
            drawn = tuple(replace(t, attempt=redrawn.get(file_name(shown, t), 0)) for t in trials)
            cases.append(
                (group, drawn, step_s, set(wanted), data.layout, data.tracking, data.chain)
            )
    merged: dict[str, dict[str, FeatureSeries | None]] = {name: {} for name in scenes}
    for answer in context.map("simulated anew", measured, cases):
        for name, contacts in answer.items():
            merged[name] |= contacts
    strange = [file for file in wanted if any(file not in contacts for contacts in merged.values())]
    if strange:
        raise InputError(
            f"{strange[0]}: the scene has no such trial; give the scene that the recordings were "
            "simulated from, or none"
        )
    return {name: [contacts[file] for file in wanted] for name, contacts in merged.items()}


def section(context: Context) -> Section | None:
    """Train on one, test on another; None where the data set was not simulated here."""
    scene = context.scene
    if scene is None:
        return None
    others = variants(scene)
    series = anew(context, {UNCHANGED: scene, **others})
    X, y = context.vectors(), context.labels
    if not np.array_equal(vectors(series.pop(UNCHANGED)), X):
        raise InputError(
            f"the scene {scene.name} gives other trials than these recordings; simulate it again, "
            "or study them without a scene"
        )
    changed = {name: vectors(contacts) for name, contacts in series.items()}
    own = context.map("their accuracy", grid_search, [(x, y) for x in changed.values()])
    plain = grid_search(X, y)
    to = context.map("trained here", transfer, [(X, y, plain, x) for x in changed.values()])
    work = [(x, y, best, X) for x, best in zip(changed.values(), own, strict=True)]
    back = context.map("trained there", transfer, work)
    table = Table(
        "robustness",
        "Another speed, arm or sensor; trained and tested on it or across",
        ("change", "task", "trained and tested", *SCORE, "without contact"),
    )
    for name, *sets in zip(others, own, to, back, strict=True):
        lost = sum(contact is None for contact in series[name])
        hows = (
            "leave-one-out with the change",
            "trained without it, tested with it",
            "trained with it, tested without it",
        )
        for how, results in zip(hows, sets, strict=True):
            table.rows += [(name, task, how, *score(r), lost) for task, r in results.items()]
    pictures = []
    for task in y:
        png = figures.bars(
            list(others),
            {
                "with the change, leave-one-out": [r[task] for r in own],
                "trained without, tested with": [r[task] for r in to],
            },
            title=f"{task}: what a change costs",
            reference={f"no change, {plain[task].accuracy:.0%}": 100 * plain[task].accuracy},
        )
        pictures.append(Figure(f"robustness_{task}", f"Robustness, {task}", png))
    return Section(
        "Another speed, another arm, each effect of the sensor",
        [
            "Each line simulates the scene anew with one thing changed and everything else drawn "
            "from the same random streams: the equilibrium point's speed (over the same way), all "
            "joint stiffnesses, and each effect of the sensor at its default size, added where "
            "the scene has it not and left out where it has.",
            "The first bar learns with the change, the second meets it for the first time: the "
            "gap between them is what a robot pays that was not trained for it. A trial's own twin "
            "without the change is never in its training set: it would tell it by itself.",
        ],
        [table],
        pictures,
    )
