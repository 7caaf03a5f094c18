"""A bench for the simulator's own step functions: one joint that pushes along a line."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from train.simulate import base, viscous
from train.simulate.arm import Kinematics
from train.simulate.effects import relaxation, sliding
from train.simulate.motion import Mover
from train.simulate.plan import Build
from train.simulate.scene import from_dict
from train.simulate.state import Bed, State


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
    """

    def __init__(
        self,
        *,
        h,
        arm_k=115.0,
        arm_d=0.0,
        speed=0.15,
        slopes=((1e4,),),
        intercepts=((0.0,),),
        travel_s=1e9,
        effects=(),
        **values,
    ):
        given = [np.asarray(v, dtype=float) for v in values.values()]
        slopes, intercepts = np.asarray(slopes, float), np.asarray(intercepts, float)
        n = max([v.size for v in (*given, np.asarray(h), slopes[0])])
        plan = Build(
            from_dict({"object": [{"name": "x", "family": "rigid", "conditions": ["fixed"]}]}),
            effects,
        )
        base.add(plan)
        for effect in effects:
            {"sliding": sliding, "relaxation": relaxation}[effect].add(plan)
        self.steps = [f for s, _, f in sorted(plan.entries, key=lambda e: e[1]) if s == "step"]
        h = np.broadcast_to(np.asarray(h, float), (n,))
        k, d = np.full((1, 1), arm_k), np.full((1, 1), arm_d)
        scene = plan.scene
        state = State(
            scene=scene,
            skin=scene.cylinder,
            trials=(),
            n=n,
            h=h,
            values={key: np.broadcast_to(v, (n,)) for key, v in zip(values, given, strict=True)},
            kinematics=Kinematics(scene.arm),
            solve=plan.solve,
            t=np.zeros(n),
        )
        state.start, state.rate, state.travel_s = np.zeros((1, n)), np.full((1, 1), speed), travel_s
        state.held, state.give, state.joint_k = d / h, 1.0 / (d / h + k), k
        state.q = state.q_frame = np.zeros((1, n))
        state.y_frame, state.jacobian = (np.zeros(n),), (np.ones((1, n)),)
        state.compliance = (np.broadcast_to(state.give, (1, n))[0],)
        state.loads = (np.zeros(n),)
        none = np.zeros((1, n))
        state.bed = Bed(none, none, none, none)
        state.bed.slopes = np.broadcast_to(slopes, (len(slopes), n))
        state.bed.intercepts = np.broadcast_to(intercepts, (len(intercepts), n))
        self.state = state
        for s, _, f in sorted(plan.entries, key=lambda e: e[1]):
            if s == "setup" and f in (sliding.stand, viscous.begin, relaxation.relax):
                f(self.state)

    def run(self, steps: int) -> Trace:
        seen = {name: [] for name in ("t", "force", "q", "target", "slide", "speed", "depth")}
        state = self.state
        n = state.n
        still = Mover(*(np.zeros(n) for _ in range(6)))
        for _ in range(steps):
            for function in self.steps:
                function(state)
            now = {
                "t": state.t,
                "force": state.loads[0],
                "q": state.q[0],
                "target": base.equilibrium(state, state.t)[0],
                "slide": state.own.get(Mover, still).slide,
                "speed": state.own.get(Mover, still).speed,
                "depth": state.depth[0],
            }
            for name, value in now.items():
                seen[name].append(np.broadcast_to(value, (n,)))
        return Trace(**{name: np.array(v) for name, v in seen.items()})


@pytest.fixture
def tools():
    """The bench, for tests that cannot import from beside themselves."""
    return SimpleNamespace(Rig=Rig, Trace=Trace)
