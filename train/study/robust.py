"""Simulated alone: another speed, another arm, and each effect of the sensor."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arm import Chain
from edge.errors import InputError
from edge.features import WINDOW_S
from edge.layout import SkinLayout
from edge.track import TrackSettings
from train.simulate.fields import EFFECTS
from train.simulate.run import simulate
from train.simulate.scene import Scene
from train.study import plots
from train.study.context import SCORE, Context, Figure, Section, Table, score
from train.study.score import Labels, evaluate, transfer
from train.study.skins import follow, vectors

FACTORS = (0.5, 2.0)


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
    for name, info in EFFECTS.items():
        if info.stage not in ("sensor", "clock"):
            continue
        if name in scene.add:
            found[f"without {name}"] = replace(scene, add=tuple(e for e in scene.add if e != name))
        else:
            found[f"with {name}"] = replace(scene, add=(*scene.add, name))
    return found


def measured(
    scene: Scene,
    wanted: list[str],
    layout: SkinLayout,
    tracking: TrackSettings,
    chain: Chain | None,
) -> tuple[NDArray[np.float64], Labels, int]:
    """Features and labels of a scene's trials, and how many had no contact.

    Args:
        scene: simulated anew.
        wanted: file names of the trials, in the order of the result.
        layout: the skin, with its thresholds.
        tracking: how contacts are followed.
        chain: the arm, or None.

    Raises:
        InputError: the scene has no trial of such a name.
    """
    # What comes after the window is not looked at.
    shorter = replace(scene, trials={**scene.trials, "after_s": WINDOW_S + 0.2})
    trials = dict(simulate(shorter))
    strange = [name for name in wanted if name not in trials]
    if strange:
        raise InputError(
            f"{strange[0]}: the scene {scene.name} has no such trial; give the scene that the "
            "recordings were simulated from, or none"
        )
    recordings = [trials[name] for name in wanted]
    series = follow(recordings, layout, tracking, chain)
    tasks = recordings[0].labels
    y = {task: np.array([r.labels[task] for r in recordings]) for task in sorted(tasks)}
    return vectors(series), y, sum(s is None for s in series)


def section(context: Context) -> Section | None:
    """Train on one, test on another; None where the data set was not simulated here."""
    scene = context.scene
    if scene is None:
        return None
    data = context.dataset
    others = variants(scene)
    names = [trial.path.name for trial in data.trials]
    cases = [(s, names, data.layout, data.tracking, data.chain) for s in (scene, *others.values())]
    (same, _, _), *found = context.map("speeds and effects", measured, cases)
    X, y = context.vectors(), context.labels
    if not (same == X).all():
        raise InputError(
            f"the scene {scene.name} gives other trials than these recordings; simulate it again, "
            "or study them without a scene"
        )
    work: list[tuple[Any, ...]] = [(x, labels) for x, labels, _ in found]
    own = context.map("their accuracy", evaluate, work)
    plain = evaluate(X, y)
    work = [(X, y, plain, x) for x, _, _ in found]
    to = context.map("trained here", transfer, work)
    work = [(x, y, best, X) for (x, _, _), best in zip(found, own, strict=True)]
    back = context.map("trained there", transfer, work)
    table = Table(
        "robustness",
        "Another speed, arm or sensor; trained and tested on it or across",
        ("change", "task", "trained and tested", *SCORE, "without contact"),
    )
    for name, (_, _, lost), *sets in zip(others, found, own, to, back, strict=True):
        hows = (
            "leave-one-out with the change",
            "trained without it, tested with it",
            "trained with it, tested without it",
        )
        for how, results in zip(hows, sets, strict=True):
            table.rows += [(name, task, how, *score(r), lost) for task, r in results.items()]
    figures = []
    for task in y:
        png = plots.bars(
            list(others),
            {
                "with the change, leave-one-out": [r[task] for r in own],
                "trained without, tested with": [r[task] for r in to],
            },
            title=f"{task}: what a change costs",
            reference={f"no change, {plain[task].accuracy:.0%}": 100 * plain[task].accuracy},
        )
        figures.append(Figure(f"robustness_{task}", f"Robustness, {task}", png))
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
        figures,
    )
