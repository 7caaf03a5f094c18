"""`make transfer`: do models that are trained on a simulated scene hold in another
physics engine?

MuJoCo makes trials of the paper's kind with parameters of its own
(`tests/checks/bench/mujoco_touch.py`), also with arms and skins of other habits, and the
models are scored on them. They are a test set: nothing in train/ reads them, and nothing
may be tuned to one set of them.
"""

import math
from dataclasses import replace
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pandas as pd
from joblib import cpu_count

from edge.decide.model import Model
from edge.decide.summary import decide
from tests.checks.bench import tables
from tests.checks.bench.mujoco_touch import (
    ONSET_COUNTS,
    PLACE_M,
    RATE_HZ,
    Thing,
    Touch,
    simulate,
)
from tests.checks.bench.program import start
from train.report.work import Workers
from train.simulate import streams

TASKS = ("category", "mobility", "softness")
UNSURE = 0.8
"""A confidence below it."""
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
}
"""Factors of what `draw_touch` draws, and the elbow's speed. The objects take turns."""
SLIDES_M = 0.02
WINDOW_S = 1.2
"""A movable object has moved this far by the end of the window, as in the scenes and
the paper."""


def log_uniform(rng, low, high):
    """A draw, even in its logarithm."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_object(rng):
    """One object's properties, from other ranges than those of any scene in train/."""
    kind = str(rng.choice("box drum foam cushion plant bale".split()))
    soft = {"foam": (3e3, 18e3), "cushion": (1.2e3, 5e3), "bale": (5e3, 12e3)}
    return Thing(
        kind=kind,
        mass_kg=log_uniform(rng, 0.25, 2.2),
        floor=rng.uniform(0.25, 0.6),
        skin=rng.uniform(0.25, 0.65),
        height_m=rng.uniform(0.12, 0.45),
        breadth_m=rng.uniform(0.06, 0.4),
        stems=int(rng.integers(5, 12)),
        stem_n_m=log_uniform(rng, 3.0, 25.0),
        thick_m=rng.uniform(0.06, 0.16),
        modulus_pa=log_uniform(rng, *soft.get(kind, (1.0, 2.0))),
        seed=int(rng.integers(2**31)),
    )


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
    attempt = 0
    while True:
        thing = draw_object(
            streams.stream(seed, f"object.{attempt}", "transfer", index)
        )
        first, second = (
            streams.stream(seed, f"trial.{attempt}", "transfer", 2 * index + number)
            for number in range(2)
        )
        free, moved_m = simulate(draw_touch(thing, False, second, habit))
        onset = int(np.argmax(free.frames.max(axis=(1, 2)) > ONSET_COUNTS))
        if moved_m[onset : onset + round(WINDOW_S * RATE_HZ) + 1][-1] >= SLIDES_M:
            return [simulate(draw_touch(thing, True, first, habit))[0], free]
        attempt += 1


def touches(seed):
    """The habit and a recording of each of 120 touches, two of each object."""
    habits = islice(cycle(HABITS), 60)
    cases = [(number, seed, habit) for number, habit in enumerate(habits)]
    pairs = Workers(cpu_count()).map("objects in MuJoCo", touch_object, cases)
    for (*_, habit), pair in zip(cases, pairs, strict=True):
        for recording in pair:
            yield habit, recording


def judge(model, touch):
    """A row: whether a model decides the tasks of a touch rightly, and how many of its
    right and of its wrong answers are called unusual, or unsure.

    A contact without a decision counts as wrong.
    """
    habit, recording = touch
    row = {"trials": habit, "kind": recording.labels["object"], "number": 1}
    row |= {f"{task} right": 0 for task in TASKS}
    row |= {
        f"{word} and {doubt}": 0
        for word in ("right", "wrong")
        for doubt in ("unusual", "unsure")
    }
    events = decide(model, recording, habit)
    first = {event.get("task"): event for event in reversed(events)}
    for task in first.keys() & TASKS:
        event = first[task]
        right = event["label"] == recording.labels[task]
        word = "right" if right else "wrong"
        row[f"{task} right"] += right
        row[f"{word} and unusual"] += "unusual" in event.get("flags", ())
        row[f"{word} and unsure"] += (event["confidence"] or 0.0) < UNSURE
    return row


def summed(rows, column):
    """The sums of rows for each value of a column."""
    groups = rows.groupby(column, sort=False)
    return groups.sum(numeric_only=True).reset_index().to_dict("records")


def measure(model, seed):
    """Make the trials, let the model decide, and write the tables."""
    loaded = Model(model)
    rows = pd.DataFrame([judge(loaded, touch) for touch in touches(seed)])
    whole = summed(rows.assign(trials="all"), "trials")
    by_habit = [*summed(rows, "trials"), *whole]
    tables.write("transfer", [by_habit, summed(rows, "kind")])


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--model", Path, "model.onnx"),
        ("--seed", 1, "of the trials"),
    )
