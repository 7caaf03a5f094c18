"""Scenes of one object, and a rig for its own steps: a joint that pushes."""

import math
from collections import namedtuple
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from train.simulate.engine import PhysicsRun, readings, run_physics
from train.simulate.plan import STEP, TUNE, kinds, plan_of
from train.simulate.readings import Readings
from train.simulate.scene import Scene, from_dict
from train.simulate.scene_model import TrialSpec
from train.simulate.trials import Batch


def one_object(**keys):
    thing = {"name": "thing", "family": "rigid", "conditions": ["fixed"], **keys}
    return [thing]


def movable(mass, static, kinetic, **keys):
    """A movable object, as a list of one."""
    moves = {"mass_kg": mass, "friction_static": static, "friction_kinetic": kinetic}
    return one_object(conditions=["movable"], **moves, **keys)


def scene(objects, families=(), **rest) -> Scene:
    """A scene whose steps are as long as a frame."""
    things = {"object": list(objects), "family": list(families)}
    return from_dict({"step_s": {"base": 0.01}, **things, **rest})


def make(objects, *add, **trials) -> Scene:
    step_s = {"base": 1.0 / trials.get("rate_hz", 100)}
    trials = {"count": 2, **trials}
    return scene(objects, trials=trials, step_s=step_s, effects={"add": list(add)})


def specs_of(scene, step_s=0.01):
    """All trials of a scene, at a step."""
    every = (spec for specs in kinds(scene).values() for spec in specs)
    return tuple(replace(spec, step_s=step_s) for spec in every)


@dataclass(frozen=True)
class RunWithReadings(PhysicsRun):
    """A run with its readings, and their counts (n, frames, rows, cols)."""

    counts: np.ndarray
    all_readings: list[Readings]


def run_batch(scene, specs, **options) -> RunWithReadings:
    physics = run_physics(scene, specs, **options)
    all_readings = list(readings(physics))
    return RunWithReadings(
        **vars(physics),
        counts=np.stack([read.frames() for read in all_readings]),
        all_readings=all_readings,
    )


def run(scene, step_s=0.01, **options) -> RunWithReadings:
    return run_batch(scene, specs_of(scene, step_s), **options)


def press(*add, **keys) -> RunWithReadings:
    """A run of one fixed object with these keys."""
    return run(make(one_object(**keys), *add))


Trace = namedtuple("Trace", "t force q target slide speed depth")
"""The rig's motion and forces, (steps, n) each."""


Law = namedtuple("Law", "slopes intercepts gaps", defaults=([[0.0]], [[-math.inf]]))
"""The lines K a - B of a bed, (S, n) each; all of them are looked at where the gaps of
its springs are not given."""
TAXELS = Law([[1e4]])


class Rig:
    """n pushers of stiffness `arm_k` whose ends run at `speed` against beds of springs.

    The step is the simulator's own; only the arm's geometry is left out (one joint of
    lever 1).
    """

    def __init__(
        self,
        h,
        law=TAXELS,
        effects=(),
        *,
        arm_k=115.0,
        arm_d=0.0,
        speed=0.15,
        travel_s=1e9,
        **values,
    ):
        law = Law(*map(np.asarray, law))
        n = max(np.size(v) for v in (*values.values(), h, law.slopes[0]))
        values = {key: np.broadcast_to(v, n) for key, v in values.items()}
        scene = from_dict({"object": one_object()})
        specs = (TrialSpec(scene.objects[0], "fixed", 0),) * n
        self.trials = t = Batch(scene, specs, values, plan_of((effects,) * n))
        t.clock.h = h
        t.joints.stiffness = np.ones((5, 1))
        t.joints.damping = np.zeros((5, 1))
        t.arm.rate[0] = speed
        t.joints.stiffness[0] = arm_k
        t.joints.damping[0] = arm_d
        t.arm.travel_s[0] = travel_s
        t.contact.jacobian[0, 0] = 1.0
        shape = (len(law.slopes), n)
        t.bed.arrays["law_gaps"] = np.broadcast_to(law.gaps, shape)
        t.bed.arrays["slopes"] = np.broadcast_to(law.slopes, shape)
        t.bed.arrays["intercepts"] = np.broadcast_to(law.intercepts, shape)
        t.everyone.run("stand", *TUNE)
        t.contact.compliance[0] = t.arm.step_compliance[0]

    def run(self, steps: int) -> Trace:
        t = self.trials
        rows = []
        still = SimpleNamespace(slide=np.zeros(t.n), speed=np.zeros(t.n))
        mover = t.states.get("sliding", still)
        for _ in range(steps):
            t.everyone.run(*STEP)
            now = Trace(
                t=t.clock.t,
                force=t.contact.loads[0],
                q=t.arm.q[0],
                target=t.everyone.equilibrium(t.clock.t)[0],
                slide=mover.slide,
                speed=mover.speed,
                depth=t.contact.depth[0],
            )
            rows.append(np.array(now))
        return Trace(*np.moveaxis(rows, 1, 0))


def slider(h, mass, static, kinetic, **rig) -> Rig:
    """A rig that pushes masses on a floor with friction."""
    moves = {"mass_kg": mass, "friction_static": static, "friction_kinetic": kinetic}
    return Rig(h, effects=("sliding",), **moves, **rig)
