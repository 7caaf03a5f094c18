"""`make transfer`: does a model trained on a simulated scene hold in another physics
engine?

MuJoCo makes trials of the paper's kind with parameters of its own
(`tests/bench/mujoco_touch.py`), also with arms and skins of other habits and of odd
things, and the model is scored on them. They are a test set: nothing in train/ reads
them, and nothing may be tuned to one set of them; `--seed` makes another.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, cpu_count, delayed

from edge.cli import dispatch
from edge.model.model import Model
from edge.model.novelty import UNKNOWN
from edge.recording import Recording
from edge.saving import save
from edge.tools.replay import Summary, decide
from tests.bench import tables
from tests.bench.mujoco_touch import (
    ONSET_COUNTS,
    PLACE_M,
    RATE_HZ,
    Thing,
    Touch,
    simulate,
)
from train.progress import bar
from train.simulate import streams

TASKS = ("category", "mobility", "softness")
ODD = "odd things"
HABITS: dict[str, dict[str, float]] = {
    "as in the paper": {},
    "arm speed x 0.5": {"speed": 0.5},
    "arm speed x 1.5": {"speed": 1.5},
    "arm stiffness x 0.5": {"stiffness": 0.5},
    "arm stiffness x 2": {"stiffness": 2.0},
    "taxels x 0.4": {"taxel_n_m": 0.4},
    "taxels x 2.5": {"taxel_n_m": 2.5},
    ODD: {},
}
"""Factors of what `draw_touch` draws. The objects take turns."""
SLIDES_M = 0.02
WINDOW_S = 1.2
"""A movable object has moved this far by the end of the window, as in the scenes and
the paper."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A draw, even in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_body(
    rng: np.random.Generator,
    kinds: str,
    mass_kg: tuple[float, float],
    narrowest_m: float,
) -> Thing:
    """The properties that all things have."""
    return Thing(
        kind=str(rng.choice(kinds.split())),
        mass_kg=log_uniform(rng, *mass_kg),
        floor=rng.uniform(0.25, 0.6),
        skin=rng.uniform(0.25, 0.65),
        height_m=rng.uniform(0.12, 0.45),
        breadth_m=rng.uniform(narrowest_m, 0.4),
    )


def draw_object(rng: np.random.Generator) -> Thing:
    """One object's properties, from other ranges than those of any scene in train/."""
    body = draw_body(rng, "box drum foam cushion plant bale", (0.25, 2.2), 0.06)
    soft = {"foam": (3e3, 18e3), "cushion": (1.2e3, 5e3), "bale": (5e3, 12e3)}
    return replace(
        body,
        stems=int(rng.integers(5, 12)),
        stem_n_m=log_uniform(rng, 3.0, 25.0),
        thick_m=rng.uniform(0.06, 0.16),
        modulus_pa=log_uniform(rng, *soft.get(body.kind, (1.0, 2.0))),
        seed=int(rng.integers(2**31)),
    )


def draw_odd(rng: np.random.Generator) -> Thing:
    """A door, a drawer, a thick cloth over something light, or a person's arm."""
    body = draw_body(rng, "door drawer cloth limb", (1.0, 3.0), 0.1)
    between = partial(log_uniform, rng)
    slide = f'<joint type="slide" axis="1 0 0" frictionloss="{between(0.5, 4.0)}" damping="2"/>'
    hinge = (
        '<joint type="hinge" axis="0 0 1" pos="0 '
        f'{rng.choice([-1, 1]) * between(0.3, 0.7)} 0" '
        f'frictionloss="{between(0.2, 1.5)}" damping="0.5"/>'
    )
    changes: dict[str, dict[str, Any]] = {
        "door": {"joint": hinge},
        "drawer": {"joint": slide, "mass_kg": between(1.0, 6.0)},
        "cloth": {"modulus_pa": between(1.5e3, 5e3), "thick_m": between(0.03, 0.06)},
        "limb": {
            "joint": slide,
            "height_m": rng.uniform(0.07, 0.11),
            "modulus_pa": between(8e3, 35e3),
            "thick_m": rng.uniform(0.02, 0.04),
        },
    }
    return replace(body, **changes[body.kind])


def draw_touch(
    thing: Thing, fixed: bool, rng: np.random.Generator, habit: str
) -> Touch:
    """One touch: how the object stands before the arm, how the arm begins, a habit's
    factors."""
    touch = Touch(
        thing=thing,
        fixed=fixed,
        start_rad=tuple(np.radians(rng.normal(0.0, (0.5, 1.0, 1.0, 3.0, 3.0)))),
        place_m=PLACE_M + rng.normal(0.0, 0.015),
        aside_m=rng.normal(0.0, 0.01),
        yaw_rad=rng.normal(0.0, 0.03),
        slope_rad=math.radians(rng.normal(0.0, 0.7)),
        taxel_n_m=log_uniform(rng, 5e3, 1.5e4),
        noise=(6.0, rng),
    )
    factors = HABITS[habit].items()
    return replace(touch, **{name: getattr(touch, name) * by for name, by in factors})


def touch_object(index: int, seed: int, habit: str) -> list[Recording]:
    """A touch of an object that is fixed, and one where it is free.

    Both are drawn again, with another object, where the free one did not move.
    """
    draw = draw_odd if habit == ODD else draw_object
    attempt = 0
    while True:
        thing = draw(streams.stream(seed, f"object.{attempt}", "transfer", index))
        first, second = (
            streams.stream(seed, f"trial.{attempt}", "transfer", number)
            for number in (2 * index, 2 * index + 1)
        )
        free, _, moved_m = simulate(draw_touch(thing, False, second, habit))
        onset = int(np.argmax(free.frames.max(axis=(1, 2)) > ONSET_COUNTS))
        if moved_m[onset : onset + round(WINDOW_S * RATE_HZ) + 1][-1] >= SLIDES_M:
            return [simulate(draw_touch(thing, True, first, habit))[0], free]
        attempt += 1


def run(arguments: argparse.Namespace) -> int:
    """Make the trials, save them in a folder for each habit, and print how the model
    decides them.

    The tables have right decisions by habit and in all, contacts called unknown, and
    each task's confusion. A contact without a decision counts as wrong.
    """
    model = Model(arguments.model)
    seed = arguments.seed
    tasks = {name: task for name, task in model.info.tasks.items() if name in TASKS}
    summaries = {habit: Summary(tasks) for habit in (*HABITS, "all")}
    unknown = 0
    habits = list(islice(cycle(HABITS), arguments.trials // 2))
    touches = Parallel(n_jobs=cpu_count(), return_as="generator")(
        delayed(touch_object)(i, seed, habit) for i, habit in enumerate(habits)
    )
    shown = bar(touches, total=len(habits), unit=" objects", desc="MuJoCo")
    for i, (habit, recordings) in enumerate(zip(habits, shown, strict=True)):
        folder = arguments.out / f"seed{seed}" / habit.replace(" ", "-")
        folder.mkdir(parents=True, exist_ok=True)
        for recording in recordings:
            labels = recording.labels
            path = folder / f"{labels['object']}-{i:02d}-{labels['mobility']}.npz"
            save(path, recording)
            events = decide(model, recording, str(path))
            unknown += any(UNKNOWN in event.get("flags", ()) for event in events)
            for name in (habit, "all"):
                summaries[name].add(labels, events)
    rows = []
    for name, summary in summaries.items():
        row: dict[str, Any] = {"trials": name, "number": summary.recordings}
        for task in tasks:
            row[f"{task} right"] = summary.right(task)[0]
        rows.append(row)
    tables.write("transfer", [rows])
    print(f"unknown: {unknown} of {2 * len(habits)}\n\n{summaries['all'].text()}")
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(
        prog="tests.bench.transfer", description=__doc__.split("\n\n")[0]
    )
    top.add_argument("--model", type=Path, required=True)
    top.add_argument("--out", type=Path, default=Path("build/transfer"))
    top.add_argument(
        "--trials", type=int, default=96, help="two of each object (%(default)s)"
    )
    top.add_argument("--seed", type=int, default=1)
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
