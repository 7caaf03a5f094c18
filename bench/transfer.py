"""`make transfer`: does a model trained on a simulated scene hold in another physics engine?

MuJoCo makes trials of the paper's kind with parameters of its own (`bench/mujoco_touch.py`), also
with arms and skins of other habits and of odd things, and the model is scored on them. They are a
test set: nothing in train/ reads them, and nothing may be tuned to one set of them; `--seed` makes
another.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, cpu_count, delayed

from bench.mujoco_touch import ONSET_COUNTS, PLACE_M, RATE_HZ, Thing, Touch, Touched, simulate
from edge.cli import dispatch
from edge.commands.replay import Summary, decide
from edge.model.model import Model
from edge.model.stopping import UNKNOWN
from edge.recording import Recording, load, save
from train.progress import bar
from train.simulate import streams

TASKS = ("category", "mobility", "softness")
EACH = 2
"""Trials of each object; every other trial is fixed."""
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
SLIDES_M, WINDOW_S = 0.02, 1.2
"""A movable object has moved this far by the end of the window, as in the scenes and the paper."""


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """A draw, even in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_body(
    rng: np.random.Generator, kinds: str, mass_kg: tuple[float, float], narrowest_m: float
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
        f'<joint type="hinge" axis="0 0 1" pos="0 {rng.choice([-1, 1]) * between(0.3, 0.7)} 0" '
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
    thing: Thing, fixed: bool, rng: np.random.Generator, habit: Mapping[str, float]
) -> Touch:
    """One touch: how the object stands before the arm, how the arm begins, a habit's factors."""
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
    return replace(touch, **{name: getattr(touch, name) * by for name, by in habit.items()})


def moved(touched: Touched) -> float:
    """Metres that the thing has moved at the end of the window."""
    onset = int(np.argmax(touched.recording.frames.max(axis=(1, 2)) > ONSET_COUNTS))
    last = min(onset + round(WINDOW_S * RATE_HZ), len(touched.moved_m) - 1)
    return float(touched.moved_m[last])


def make_trials(folder: Path, count: int, seed: int) -> dict[str, list[Path]]:
    """{habit: recordings}, `count` in all; those of an earlier run are used again.

    Each habit has a folder, and each object `EACH` recordings. An object is drawn again
    where a trial that is called movable did not move.
    """
    numbers = [range(first, min(first + EACH, count)) for first in range(0, count, EACH)]
    habits = [list(HABITS)[i % len(HABITS)] for i in range(len(numbers))]
    work = (
        delayed(_touch_object)(folder / habit.replace(" ", "-"), i, numbers[i], seed, habit)
        for i, habit in enumerate(habits)
    )
    done = Parallel(n_jobs=cpu_count(), return_as="generator")(work)
    paths: dict[str, list[Path]] = {habit: [] for habit in HABITS}
    shown = bar(done, total=len(habits), unit=" objects", desc="MuJoCo")
    for habit, made in zip(habits, shown, strict=True):
        paths[habit] += made
    return paths


def _touch_object(folder: Path, index: int, numbers: range, seed: int, habit: str) -> list[Path]:
    """The recordings of one object."""
    folder.mkdir(parents=True, exist_ok=True)
    earlier = sorted(folder.glob(f"*-{index:02d}-*.npz"))
    if len(earlier) == len(numbers):
        return earlier
    for attempt in itertools.count():
        draw = draw_odd if habit == ODD else draw_object
        thing = draw(streams.stream(seed, f"object.{attempt}", "transfer", index))
        recordings: dict[Path, Recording] = {}
        for number in sorted(numbers, key=lambda n: n % 2 == 0):
            rng = streams.stream(seed, f"trial.{attempt}", "transfer", number)
            touched = simulate(draw_touch(thing, number % 2 == 0, rng, HABITS[habit]))
            if number % 2 == 1 and moved(touched) < SLIDES_M:
                break
            condition = touched.recording.labels["mobility"]
            name = f"{thing.kind}-{index:02d}-{condition}-{number:03d}.npz"
            recordings[folder / name] = touched.recording
        else:
            break
    for path, recording in recordings.items():
        save(path, recording)
    return list(recordings)


def run(arguments: argparse.Namespace) -> int:
    """Make the trials, and print how the model decides them.

    The tables have right decisions by habit and in all, contacts called unknown, and each task's
    confusion. A contact without a decision counts as wrong.
    """
    model, folder = Model(arguments.model), arguments.out / f"seed{arguments.seed}"
    tasks = {name: task for name, task in model.info.tasks.items() if name in TASKS}
    by_habit = make_trials(folder, arguments.trials, arguments.seed)
    pooled, unknown = Summary(tasks), 0
    print(f"{'right':<20}" + "".join(f"{task:>12}" for task in tasks))
    for habit, paths in by_habit.items():
        summary = Summary(tasks)
        for path in paths:
            recording = load(path)
            events = decide(model, recording, str(path))
            unknown += any(UNKNOWN in event.get("flags", ()) for event in events)
            for each in (summary, pooled):
                each.add(recording.labels, events)
        right = "".join(f"{summary.right(task)[0]:>12}" for task in tasks)
        print(f"{habit:<20}{right} of {summary.recordings}")
    print(f"unknown: {unknown} of {pooled.recordings}\n\n{pooled.text()}")
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="bench.transfer", description=__doc__.split("\n\n")[0])
    top.add_argument("--model", type=Path, required=True)
    top.add_argument("--out", type=Path, default=Path("build/transfer"))
    top.add_argument("--trials", type=int, default=96)
    top.add_argument("--seed", type=int, default=1)
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
