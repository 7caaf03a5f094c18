"""Scenes of one object, and a rig for its own steps: a joint that pushes."""

import math
from collections import namedtuple
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from train.simulate.convergence import kinds
from train.simulate.engine import PhysicsRun, readings, run_physics
from train.simulate.plan import STEP, TUNE, plan_of
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
class Seen(PhysicsRun):
    """A run with its readings, and their counts (n, frames, rows, cols)."""

    counts: np.ndarray
    seen: list[Readings]


def run_batch(scene, specs, **options) -> Seen:
    physics = run_physics(scene, specs, **options)
    seen = list(readings(physics))
    return Seen(
        **vars(physics), counts=np.stack([read.frames() for read in seen]), seen=seen
    )


def run(scene, step_s=0.01, **options) -> Seen:
    return run_batch(scene, specs_of(scene, step_s), **options)


Trace = namedtuple("Trace", "t force q target slide speed depth")
"""The rig's motion and forces, (steps, n) each."""


class Rig:
    """n pushers of stiffness `arm_k` whose ends run at `speed` against beds of springs.

    The step is the simulator's own; only the arm's geometry is left out (one joint of
    lever 1). All lines of a bed's law are looked at where the gaps of its springs are
    not given.
    """

    def __init__(  # noqa: PLR0913 - the physics of one test each
        self,
        *,
        h,
        arm_k=115.0,
        arm_d=0.0,
        speed=0.15,
        travel_s=1e9,
        effects=(),
        gaps=((-math.inf,),),
        slopes=((1e4,),),
        intercepts=((0.0,),),
        **values,
    ):
        given = [np.asarray(v, dtype=float) for v in values.values()]
        law = [np.asarray(part, dtype=float) for part in (gaps, slopes, intercepts)]
        n = max([v.size for v in (*given, np.asarray(h), law[1][0])])
        box = {"name": "x", "family": "rigid", "conditions": ["fixed"]}
        scene = from_dict({"object": [box]})
        values = {
            key: np.broadcast_to(v, (n,)) for key, v in zip(values, given, strict=True)
        }
        specs = (TrialSpec(scene.objects[0], "fixed", 0),) * n
        self.trials = t = Batch(scene, specs, values, plan_of((effects,) * n))
        t.clock.h = np.broadcast_to(np.asarray(h, float), (n,)).copy()
        t.joints.rate, t.joints.stiffness, t.joints.damping = (
            np.zeros((5, 1)),
            np.ones((5, 1)),
            np.zeros((5, 1)),
        )
        t.joints.rate[0] = speed
        t.joints.stiffness[0] = arm_k
        t.joints.damping[0] = arm_d
        t.arm.travel_s[0] = travel_s
        t.contact.jacobian[0, 0] = 1.0
        shape = (len(law[1]), n)
        for name, part in zip(("law_gaps", "slopes", "intercepts"), law, strict=True):
            t.bed.arrays[name] = np.broadcast_to(part, shape)
        t.everyone.run("stand", *TUNE)
        t.contact.compliance[0] = t.arm.step_compliance[0]

    def run(self, steps: int) -> Trace:
        t = self.trials
        seen = []
        still = np.zeros(self.trials.n)
        for _ in range(steps):
            t.everyone.run(*STEP)
            mover = t.states.get("sliding", SimpleNamespace(slide=still, speed=still))
            now = (
                t.clock.t,
                t.contact.loads[0],
                t.arm.q[0],
                t.everyone.equilibrium(t.clock.t)[0],
            )
            seen.append(np.array([*now, mover.slide, mover.speed, t.contact.depth[0]]))
        return Trace(*np.moveaxis(seen, 1, 0))


def slider(h, mass, static, kinetic, **rig) -> Rig:
    """A rig that pushes masses on a floor with friction."""
    moves = {"mass_kg": mass, "friction_static": static, "friction_kinetic": kinetic}
    return Rig(h=h, effects=("sliding",), **moves, **rig)
