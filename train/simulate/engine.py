"""Run a batch of trials through its plan."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate import streams
from train.simulate.arm import Array, Kinematics
from train.simulate.assemble import make_plan
from train.simulate.plan import Plan
from train.simulate.required_effects import required_effects
from train.simulate.scene_model import Scene, SceneObject, TrialSpec
from train.simulate.schema import SPREAD, STIFFNESSES
from train.simulate.sensor_frames import SensorFrames
from train.simulate.state import Readings, State


@dataclass(frozen=True)
class Kind:
    """Trials that run the same plan on beds of the same form, and so can share a batch."""

    effects: tuple[str, ...]
    curved: bool
    """Rows lie at different depths; a flat bed's law needs one line a column only."""
    stems: int


def kind_of(scene: Scene, item: SceneObject, condition: str) -> Kind:
    """What an object's trials have in common with others that can share their batch."""
    effects = tuple(required_effects(scene, item, condition))
    curved = "radius_m" in item.given and "tilt" not in effects
    stems = int(item.values["stem_count"].low) if "stem_count" in item.values else 0
    return Kind(effects, curved, stems)


@dataclass(frozen=True)
class Batch:
    """What a batch of n trials gave, `frames` frames each.

    Attributes:
        t: (frames,) seconds.
        times: (n, frames) seconds, where a clock effect shifts them; None elsewhere.
        kept: (n, frames) bool, where frames are dropped; None elsewhere.
        counts: (n, frames, rows, cols) uint16.
        valid: (n, rows, cols) bool, or None.
        joints: (n, frames, dof) radians.
        force: (n, frames) newtons.
        traces: {name: (n, frames)} of what the effects keep, such as `slide_m`.
        state: what the plan left behind.
    """

    trials: tuple[TrialSpec, ...]
    t: Array
    counts: NDArray[np.uint16]
    joints: Array
    force: Array
    times: Array | None
    kept: NDArray[np.bool_] | None
    valid: NDArray[np.bool_] | None
    traces: dict[str, Array]
    state: State


def values_of(scene: Scene, trials: tuple[TrialSpec, ...]) -> dict[str, Array]:
    """{name: (n,)} of every value and spread; a trial's draws depend on nothing but itself.

    Where an object has no such value (a fixed one its mass), it is NaN and nothing reads it.
    """
    groups: dict[str, list[int]] = {}
    for i, trial in enumerate(trials):
        groups.setdefault(trial.key, []).append(i)
    out: dict[str, Array] = {}
    for key, members in groups.items():
        where = np.array(members)
        numbers = np.array([trials[i].number for i in members], dtype=np.int64)
        item = trials[members[0]].object

        def spread(name: str, key: str = key, numbers: Any = numbers) -> Any:
            amount = scene.spread[name]
            if amount == 0.0:
                return 0.0
            return amount * streams.draws(scene.seed, f"spread.{name}", key, numbers, "normal")

        own = {**item.values, "lead_s": scene.lead, "taxel_n_m": scene.taxel_n_m}
        for name, value in own.items():
            drawn: Any = value.low
            if value.varies:
                part = streams.draws(scene.seed, f"value.{name}", key, numbers, "uniform")
                drawn = value.low + (value.high - value.low) * part
            if name in STIFFNESSES:
                drawn = drawn * np.exp(spread("stiffness"))
            elif name in ("friction_static", "friction_kinetic"):
                drawn = drawn * np.exp(spread("friction"))
            elif name == "mass_kg":
                drawn = drawn * np.exp(spread("mass"))
            elif name in ("taxel_n_m", "cover_n_m"):
                drawn = drawn * np.exp(spread("cover"))
            out.setdefault(name, np.full(len(trials), np.nan))[where] = drawn
        for name in SPREAD:
            if name in ("place_m", "yaw_deg", "roll_deg"):
                out.setdefault(name, np.full(len(trials), np.nan))[where] = spread(name)
    return out


def frame_count(scene: Scene) -> int:
    """Frames of a trial: the longest lead, what follows, and the frame at t = 0."""
    duration = scene.lead.high + scene.trials["after_s"]
    return round(duration * scene.trials["rate_hz"]) + 1


def begin(
    scene: Scene, plan: Plan, trials: tuple[TrialSpec, ...], step_s: float, values: dict[str, Array]
) -> State:
    """The state of a batch before its first step."""
    state = State(
        scene=scene,
        skin=scene.cylinder,
        trials=trials,
        n=len(trials),
        h=step_s,
        values=values,
        kinematics=Kinematics(scene.arm),
        solve=plan.solve,
    )
    for function in plan.setup:
        function(state)
    return state


@dataclass(frozen=True)
class PhysicsRun:
    """The physics of a batch: what its skin bears, before any sensor reads it.

    Attributes:
        frames: the load on the taxels, frame by frame.
        t: (frames,) seconds.
        joints: (n, frames, dof) radians.
        force: (n, frames) newtons.
        traces: {name: (n, frames)}.
        state: what the plan left behind.
    """

    frames: SensorFrames
    t: Array
    joints: Array
    force: Array
    traces: dict[str, Array]
    state: State


def run_batch(
    scene: Scene,
    trials: tuple[TrialSpec, ...],
    step_s: float,
    *,
    plan: Plan | None = None,
    values: dict[str, Array] | None = None,
    images: bool = True,
) -> Batch:
    """Simulate trials of one kind together; each comes out as it would alone, bit by bit.

    Args:
        step_s: the physics' step; a whole number of them makes a frame.
        plan: the kind's, where it is at hand.
        values: {name: (n,)} in place of the scene's draws.
        images: False for the physics alone (forces, joints); `counts` are then empty.
    """
    first = trials[0]
    plan = plan or make_plan(scene, kind_of(scene, first.object, first.condition).effects)
    physics = run_physics(scene, trials, step_s, plan=plan, values=values, images=images)
    return read_out(physics, plan)


def run_physics(
    scene: Scene,
    trials: tuple[TrialSpec, ...],
    step_s: float,
    *,
    plan: Plan,
    values: dict[str, Array] | None = None,
    images: bool = True,
) -> PhysicsRun:
    """The physics of `run_batch`, with the same arguments."""
    values = values_of(scene, trials) if values is None else values
    frames = frame_count(scene)
    rate_hz = scene.trials["rate_hz"]
    substeps = max(1, round(1.0 / (rate_hz * step_s)))
    step_s = 1.0 / (rate_hz * substeps)
    state = begin(scene, plan, trials, step_s, values)
    n, dof = len(trials), len(scene.stiffness)
    joints = np.empty((frames, dof, n))
    force = np.zeros((frames, n))
    traces = {name: np.zeros((frames, n)) for name in plan.traces}
    seen = SensorFrames(scene, plan, state, frames if images else 0)
    joints[0] = state.q
    sample = plan.sample if images else plan.sample[:1]
    for k in range(1, frames):
        for function in plan.frame:
            function(state)
        for _ in range(substeps):
            for function in plan.step:
                function(state)
        state.t = k / rate_hz
        for function in sample:
            function(state)
        joints[k] = state.q
        force[k] = state.force
        for name, quantity in plan.traces.items():
            traces[name][k] = quantity(state)
        if images:
            seen.take(k, state)
    return PhysicsRun(
        frames=seen,
        t=np.arange(frames) / rate_hz,
        joints=np.ascontiguousarray(joints.transpose(2, 0, 1)),
        force=np.ascontiguousarray(force.T),
        traces={name: np.ascontiguousarray(kept.T) for name, kept in traces.items()},
        state=state,
    )


def read_out(physics: PhysicsRun, plan: Plan) -> Batch:
    """The batch as a plan's sensor and clock show it.

    One run serves any plan that differs in these alone, as long as each of them has some: the
    frames are kept in whole counts where no sensor's effect is called for.
    """
    state = physics.state
    readings = Readings(
        seed=state.scene.seed,
        trials=state.trials,
        t=physics.t,
        counts=physics.frames.whole(state),
        joints=physics.joints.copy(),
    )
    for function in (*plan.clock, *plan.sensor):
        function(readings)
    return Batch(
        trials=state.trials,
        t=physics.t,
        counts=physics.frames.in_counts(readings.counts),
        joints=readings.joints,
        force=physics.force,
        times=readings.times,
        kept=readings.kept,
        valid=readings.valid,
        traces=physics.traces,
        state=state,
    )
