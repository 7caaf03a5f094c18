"""`make transfer`: do models that are trained on a simulated scene hold in another
physics engine?

MuJoCo makes trials of the paper's kind with parameters of its own
(`tests/bench/mujoco_touch.py`), also with arms and skins of other habits and of odd
things, and the models are scored on them. They are a test set: nothing in train/ reads
them, and nothing may be tuned to one set of them.

Four touches are also made in both engines, with the same arm and the same thing: a face
parallel to the forearm, rigid or soft, fixed or movable. The last table has the total
force from 0.9 to 1.2 s after the touch, which may differ by 10 %.

`make shear-transfer` scores a model with features of shear beside one without.
"""

import math
from dataclasses import replace
from functools import partial
from itertools import cycle, islice
from pathlib import Path

import numpy as np
import pandas as pd
from joblib import cpu_count

from edge.model.info import UNKNOWN
from edge.model.model import Model
from edge.tools.replay import Summary, decide
from tests.bench import mujoco_touch, tables
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
from train.simulate.convergence import kinds
from train.simulate.engine import run_physics
from train.simulate.scene import from_dict

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


UPRIGHT_DEG = (0.0, -4.0, 0.0, -3.9, 0.0)
"""With this start the forearm hangs straight as it touches a standing face."""
MIDDLE_M = 0.10332
"""The middle of the skin's 16 rows, from the wrist."""
BOX = Thing("box", floor=0.3, height_m=0.3, below_m=0.15)
FOAM = Thing("foam", floor=0.3, height_m=14 * 0.0108, breadth_m=0.15)
"""The box is taller than the skin, and the foam ends between two rows."""


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


def judge(models, touch):
    """A row for each {name: model}: whether it decides the tasks of a touch rightly.

    A contact without a decision counts as wrong.
    """
    number, habit, recording = touch
    for name, model in models.items():
        events = decide(model, recording, f"touch {number}")
        tasks = [task for task in TASKS if task in model.info.tasks]
        summary = Summary(dict.fromkeys(tasks))
        summary.add(recording.labels, events)
        row = {"model": name, "trials": habit, "kind": recording.labels["object"]}
        row |= {f"{task} right": summary.right(task)[0] for task in tasks}
        row["unknown"] = int(any(UNKNOWN in event.get("flags", ()) for event in events))
        yield row | {"number": 1}


def summed(rows, column):
    """The sums of rows for each model and each value of a column."""
    groups = rows.groupby(["model", column], sort=False)
    return groups.sum(numeric_only=True).reset_index().to_dict("records")


def our_force(thing, fixed):
    """(n,) newtons of a touch in our simulator."""
    item = {
        "name": "thing",
        "family": "rigid",
        "conditions": ["fixed" if fixed else "movable"],
        "width_m": thing.height_m,
        "breadth_m": thing.breadth_m,
        "mass_kg": thing.mass_kg,
        "friction_static": thing.floor,
        "friction_kinetic": thing.floor,
        "skin_friction": thing.skin,
    }
    if thing.soft:
        item |= {"family": "foam", "relax_ratio": 0.6, "relax_s": 0.06}
        item |= {"modulus_pa": thing.modulus_pa, "depth_m": thing.thick_m}
    start_deg = np.add(mujoco_touch.START_DEG, UPRIGHT_DEG).tolist()
    trials = {
        "count": 1,
        "lead_s": mujoco_touch.LEAD_S,
        "after_s": mujoco_touch.TOUCH_S,
    }
    scene = from_dict(
        {
            "trials": trials,
            "motion": {"start_deg": start_deg, "place_m": MIDDLE_M},
            "step_s": {"base": 0.00125},
            "effects": {"add": ["tilt", "inertia"]},
            "object": [item],
        }
    )
    return run_physics(scene, tuple(next(iter(kinds(scene).values())))).force[0]


def held_n(force):
    """The mean of newtons (n,) from 0.9 to 1.2 s after the first."""
    touched_s = np.argmax(force > 0.0) / RATE_HZ
    first = round((touched_s + 0.9) * RATE_HZ)
    return force[first : first + round(0.3 * RATE_HZ)].mean()


def both_engines():
    """A row for each touch that is made in both engines."""
    for thing in (BOX, FOAM):
        for fixed in (True, False):
            touch = Touch(
                thing, fixed, tuple(np.radians(UPRIGHT_DEG)), place_m=MIDDLE_M
            )
            theirs = held_n(simulate(touch)[1])
            ours = held_n(our_force(thing, fixed))
            yield {
                "touch": touch.labels["category"],
                "force in MuJoCo, N": f"{theirs:.3g}",
                "ours": f"{ours:.3g}",
                "difference": f"{100 * (ours / theirs - 1):+.0f} %",
            }


def measure(models, table, trials, seeds):
    """Make the trials, let the models decide, and write the table."""
    loaded = {path.parent.name: Model(path) for path in map(Path, models)}
    rows = []
    for seed in range(1, seeds + 1):
        for touch in touches(seed, trials):
            rows += judge(loaded, touch)
    rows = pd.DataFrame(rows)
    whole = summed(rows.assign(trials="all"), "trials")
    by_habit = [*summed(rows, "trials"), *whole]
    tables.write(table, [by_habit, summed(rows, "kind"), list(both_engines())])


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--models", list, "model.onnx files, each in a folder that names it"),
        ("--table", "transfer", "its name in docs/measured"),
        ("--trials", 132, "of each test set, two of each object"),
        ("--seeds", 1, "test sets"),
    )
