"""A bench for the simulator's own step functions: one joint that pushes along a line."""

from __future__ import annotations

import math
from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from train.simulate import base
from train.simulate.compiled import each
from train.simulate.effects import relaxation, sliding
from train.simulate.motion import MOVER
from train.simulate.plan import Build
from train.simulate.scene import from_dict
from train.simulate.state import State


@dataclass
class Trace:
    """What the bench saw: (steps, n) each."""

    t: np.ndarray
    force: np.ndarray
    q: np.ndarray
    target: np.ndarray
    slide: np.ndarray
    speed: np.ndarray
    depth: np.ndarray


class Rig:
    """n pushers of stiffness `arm_k` whose ends run at `speed` against beds of springs.

    The step is the simulator's own; only the arm's geometry is left out (one joint of lever 1).
    A bed's law is looked at whole where the gaps of its springs are not given.
    """

    def __init__(
        self,
        *,
        h,
        arm_k=115.0,
        arm_d=0.0,
        speed=0.15,
        gaps=((-math.inf,),),
        slopes=((1e4,),),
        intercepts=((0.0,),),
        travel_s=1e9,
        effects=(),
        **values,
    ):
        given = [np.asarray(v, dtype=float) for v in values.values()]
        law = [np.asarray(part, dtype=float) for part in (gaps, slopes, intercepts)]
        n = max([v.size for v in (*given, np.asarray(h), law[1][0])])
        build = Build(
            from_dict({"object": [{"name": "x", "family": "rigid", "conditions": ["fixed"]}]}),
            effects,
        )
        base.add(build)
        for build.owner in effects:
            {"sliding": sliding, "relaxation": relaxation}[build.owner].add(build)
        plan = build.plan()
        self.steps = plan.addresses("step")
        h = np.broadcast_to(np.asarray(h, float), (n,))
        self.state = state = State(
            scene=build.scene,
            skin=build.scene.cylinder,
            trials=(),
            n=n,
            steps=1,
            values={key: np.broadcast_to(v, (n,)) for key, v in zip(values, given, strict=True)},
            solve=plan.solve.address,
        )
        t = state.trial
        t.h, t.joints, t.coordinates = h, 1, 1
        t.rate[:, 0], t.travel_s[:, 0], t.joint_k[:, 0] = speed, travel_s, arm_k
        t.damping[:, 0] = arm_d
        t.jacobian[:, 0, 0] = 1.0
        t.law_lines = len(law[1])
        t.law_gaps, t.slopes, t.intercepts = (
            state.lend(name, np.broadcast_to(part, (len(law[1]), n)))
            for name, part in zip(("law_gaps", "slopes", "intercepts"), law, strict=True)
        )
        for function in plan.setup:
            if plan.owners[function] != "base":
                function(state)
        each(plan.addresses("tune"), t.here)
        t.compliance[:, 0] = t.give[:, 0]

    def run(self, steps: int) -> Trace:
        t, seen = self.state.trial, []
        mover = self.state.own.get(MOVER, MOVER.rows(self.state.n))
        for _ in range(steps):
            each(self.steps, t.here)
            target = t.start[:, 0] + t.rate[:, 0] * np.minimum(t.t, t.travel_s[:, 0])
            now = (t.t, t.loads[:, 0], t.q[:, 0], target, mover.slide, mover.speed, t.depth[:, 0])
            seen.append(np.array(now))
        return Trace(*np.moveaxis(seen, 1, 0))


@pytest.fixture
def tools():
    """The bench, for tests that cannot import from beside themselves."""
    return SimpleNamespace(Rig=Rig, Trace=Trace)
