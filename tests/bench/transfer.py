"""`make transfer`: does a model trained on a simulated scene hold in another physics
engine?

MuJoCo makes trials of the paper's kind with parameters of its own
(`tests/bench/mujoco_touch.py`), also with arms and skins of other habits and of odd
things, and the model is scored on them. They are a test set: nothing in train/ reads
them, and nothing may be tuned to one set of them; `--seed` makes another.
"""

import math
from dataclasses import replace
from functools import partial
from itertools import cycle, islice
from pathlib import Path

import numpy as np
from joblib import cpu_count

from edge.model.info import UNKNOWN
from edge.model.model import Model
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
from tests.bench.program import start
from train.report.work import Workers
from train.simulate import streams

TASKS = ("category", "mobility", "softness")
ODD = "odd things"
HABITS = {
    "as in the paper": {},
    "arm speed x 0.5": {"speed": 0.5},
    "arm speed x 1.5": {"speed": 1.5},
    "arm stiffness x 0.5": {"stiffness": 0.5},
    "arm stiffness x 2": {"stiffness": 2.0},
    "taxels x 0.4": {"taxel_n_m": 0.4},
    "taxels x 2.5": {"taxel_n_m": 2.5},
    "elbow bends x 0.4": {"elbow": 0.4},
    "elbow stretches x 0.4": {"elbow": -0.4},
    "posture x 4": {"start_rad": 4.0},
    ODD: {},
}
"""Factors of what `draw_touch` draws, and the elbow's speed. The objects take turns."""
SLIDES_M = 0.02
WINDOW_S = 1.2
"""A movable object has moved this far by the end of the window, as in the scenes and
the paper."""


def log_uniform(rng, low, high):
    """A draw, even in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_body(rng, kinds, mass_kg, narrowest_m):
    """The properties that all things have."""
    return Thing(
        kind=str(rng.choice(kinds.split())),
        mass_kg=log_uniform(rng, *mass_kg),
        floor=rng.uniform(0.25, 0.6),
        skin=rng.uniform(0.25, 0.65),
        height_m=rng.uniform(0.12, 0.45),
        breadth_m=rng.uniform(narrowest_m, 0.4),
    )


def draw_object(rng):
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


def draw_odd(rng):
    """A door, a drawer, a thick cloth over something light, or a person's arm."""
    body = draw_body(rng, "door drawer cloth limb", (1.0, 3.0), 0.1)
    between = partial(log_uniform, rng)
    slide = f'<joint type="slide" axis="1 0 0" frictionloss="{between(0.5, 4.0)}" damping="2"/>'
    hinge = (
        '<joint type="hinge" axis="0 0 1" pos="0 '
        f'{rng.choice([-1, 1]) * between(0.3, 0.7)} 0" '
        f'frictionloss="{between(0.2, 1.5)}" damping="0.5"/>'
    )
    changes = {
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


def draw_touch(thing, fixed, rng, habit):
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
        noise=rng,
    )
    changed = {}
    for name, by in HABITS[habit].items():
        drawn = getattr(touch, name)
        changed[name] = by if name == "elbow" else np.multiply(drawn, by)
    return replace(touch, **changed)


def touch_object(index, seed, habit):
    """A touch of an object that is fixed, and one where it is free.

    Both are drawn again, with another object, where the free one did not move.
    """
    draw = draw_odd if habit == ODD else draw_object
    attempt = 0
    while True:
        thing = draw(streams.stream(seed, f"object.{attempt}", "transfer", index))
        first, second = (
            streams.stream(seed, f"trial.{attempt}", "transfer", 2 * index + number)
            for number in range(2)
        )
        free, _, moved_m = simulate(draw_touch(thing, False, second, habit))
        onset = int(np.argmax(free.frames.max(axis=(1, 2)) > ONSET_COUNTS))
        if moved_m[onset : onset + round(WINDOW_S * RATE_HZ) + 1][-1] >= SLIDES_M:
            return [simulate(draw_touch(thing, True, first, habit))[0], free]
        attempt += 1


def touches(seed, trials):
    """The number, the habit and a recording of each touch, two of each object; of half
    as many objects as trials, but at least one."""
    habits = islice(cycle(HABITS), max(trials // 2, 1))
    cases = [(number, seed, habit) for number, habit in enumerate(habits)]
    pairs = Workers(cpu_count()).map("objects in MuJoCo", touch_object, cases)
    for (number, _, habit), pair in zip(cases, pairs, strict=True):
        for recording in pair:
            yield number, habit, recording


def judged_tasks(model):
    """{task: what a model's metadata say of it} of those that the touches have."""
    return {name: task for name, task in model.info.tasks.items() if name in TASKS}


def right_rows(summaries, tasks):
    """A row of right decisions for each {name: summary}."""
    rows = []
    for name, summary in summaries.items():
        row = {"trials": name, "number": summary.recordings}
        for task in tasks:
            row[f"{task} right"] = summary.right(task)[0]
        rows.append(row)
    return rows


def measure(model, out, trials, seed):
    """Make the trials, save them in a folder for each habit, and print how the model
    decides them.

    The tables have right decisions by habit, by kind of thing and in all, contacts
    called unknown, and each task's confusion. A contact without a decision counts as
    wrong.
    """
    loaded = Model(model)
    tasks = judged_tasks(loaded)
    by_habit = {habit: Summary(tasks) for habit in (*HABITS, "all")}
    by_kind = {}
    unknown = 0
    for number, habit, recording in touches(seed, trials):
        labels = recording.labels
        folder = out / f"seed{seed}" / habit.replace(" ", "-")
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / f"{labels['object']}-{number:02d}-{labels['mobility']}.npz"
        save(path, recording)
        events = decide(loaded, recording, str(path))
        unknown += any(UNKNOWN in event.get("flags", ()) for event in events)
        by_habit[habit].add(labels, events)
        by_habit["all"].add(labels, events)
        by_kind.setdefault(labels["object"], Summary(tasks)).add(labels, events)
    written = [right_rows(by_habit, tasks), right_rows(by_kind, tasks)]
    tables.write("transfer", written)
    whole = by_habit["all"]
    print(f"unknown: {unknown} of {whole.recordings}\n\n{whole.text()}")


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--model", Path, "model.onnx"),
        ("--out", Path("build/transfer"), "folder"),
        ("--trials", 132, "two of each object"),
        ("--seed", 1, "of the test set"),
    )
