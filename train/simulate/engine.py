"""Run a batch of trials through its plan."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import EdgeError, InputError
from train.simulate import streams
from train.simulate.arm import Kinematics
from train.simulate.assemble import make_plan
from train.simulate.base import equilibrium
from train.simulate.contact import Array
from train.simulate.plan import Plan
from train.simulate.required_effects import required_effects
from train.simulate.scene_model import Scene, SceneObject, TrialSpec
from train.simulate.schema import SPREAD, STIFFNESSES
from train.simulate.sensor_frames import SensorFrames
from train.simulate.state import Kept, Readings, State


@dataclass(frozen=True)
class Kind:
    """Trials that run the same plan on beds of the same form, and so can share a batch."""

    effects: tuple[str, ...]
    curved: bool
    """Rows lie at different depths; a flat bed's law needs one line a column only."""


def kind_of(scene: Scene, item: SceneObject, condition: str) -> Kind:
    """What an object's trials have in common with others that can share their batch."""
    effects = tuple(required_effects(scene, item, condition))
    curved = "radius_m" in item.given and "tilt" not in effects
    return Kind(effects, curved)


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
    groups: dict[tuple[str, int], list[int]] = {}
    for i, trial in enumerate(trials):
        groups.setdefault((trial.key, trial.attempt), []).append(i)
    out: dict[str, Array] = {}
    for (key, attempt), members in groups.items():
        where = np.array(members)
        numbers = np.array([trials[i].number for i in members], dtype=np.int64)
        item = trials[members[0]].object

        def draw(name: str, kind: str, attempt: int = attempt, rest: Any = (key, numbers)) -> Array:
            again = f".{attempt}" if attempt else ""
            return streams.draws(scene.seed, name + again, rest[0], rest[1], kind)

        def spread(name: str, draw: Callable[[str, str], Array] = draw) -> Any:
            amount = scene.spread[name]
            return 0.0 if amount == 0.0 else amount * draw(f"spread.{name}", "normal")

        own = {**item.values, "lead_s": scene.lead, "taxel_n_m": scene.taxel_n_m}
        for name, value in own.items():
            drawn: Any = value.low
            if value.varies:
                drawn = value.low + (value.high - value.low) * draw(f"value.{name}", "uniform")
            if name in STIFFNESSES:
                drawn = drawn * np.exp(spread("stiffness"))
            elif name in ("friction_static", "friction_kinetic"):
                drawn = drawn * np.exp(spread("friction"))
            elif name == "mass_kg":
                drawn = drawn * np.exp(spread("mass"))
            elif name in ("aside_m", "slope_deg"):
                drawn = drawn + spread(name)
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
    check_start(state, plan)
    n, dof = len(trials), len(scene.stiffness)
    joints = np.empty((frames, dof, n))
    force = np.zeros((frames, n))
    traces = {name: np.zeros((frames, n)) for name in plan.traces}
    seen = SensorFrames(scene, plan, state, frames if images else 0)
    kept: list[Kept] = [(joints, lambda state: state.q), (force, lambda state: state.force)]
    kept += [(traces[name], quantity) for name, quantity in plan.traces.items()]
    if images:
        kept.append((seen.window.transpose(1, 2, 3, 0), seen.of))
    # The clock and the force alone, where no images are asked for.
    sample = plan.sample if images else plan.sample[:2]
    joints[0] = state.q
    for k in range(1, frames):
        for function in (*plan.frame, *substeps * plan.step, *sample):
            function(state)
        for room, quantity in kept:
            room[k] = quantity(state)
        if k == 1 and plan.taped:
            from train.simulate.recorder import Recorder

            stages = ((plan.frame, 1), (plan.step, substeps), (sample, 1))
            Recorder(state, kept).run(stages, k + 1, frames)
            break
    t = np.arange(frames) / rate_hz
    check_energy(scene, state, joints, t)
    return PhysicsRun(
        frames=seen,
        t=t,
        joints=np.ascontiguousarray(joints.transpose(2, 0, 1)),
        force=np.ascontiguousarray(force.T),
        traces={name: np.ascontiguousarray(kept.T) for name, kept in traces.items()},
        state=state,
    )


ENERGY_MADE = 0.01
"""Share of the work put in that the arm may hold beyond it: what sampling at frames leaves open."""


def check_start(state: State, plan: Plan) -> None:
    """Refuse a batch in which an object bears force before the arm has moved.

    Raises:
        InputError: names the first such trial, and by how much its face is turned.
    """
    for function in plan.frame:
        function(state)
    held = state.solve(state, state.y_frame, tuple(np.zeros_like(c) for c in state.compliance))
    if (held[0] > 0.0).any():
        i = int(np.argmax(held[0] > 0.0))
        trial, yaw = state.trials[i], abs(state.values["yaw_deg"][i])
        raise InputError(
            f"{state.scene.name}: object {trial.object.name!r} touches the arm before it moves, in "
            f"trial {trial.number} of {trial.key}, where the face is turned by {yaw:.0f} degrees; "
            "give spread.yaw_deg or the object's width_m less, or trials.lead_s more time"
        )


def check_energy(scene: Scene, state: State, joints: Array, t: Array) -> None:
    """Refuse a batch in which energy came out of nothing.

    The equilibrium point's motion is all that puts energy in, W = int k (q_eq - q) dq_eq, and the
    joints' damping takes at least d (dq)^2 / dt of it in each frame; so the arm's springs hold at
    most what is left, and what the arm brought as speed. What a contact has taken it may give back,
    but no more. A step that makes energy breaks the bound at once.

    Args:
        joints: (frames, dof, n) radians.
        t: (frames,) seconds.

    Raises:
        EdgeError: names the first trial that broke it.
    """
    target = equilibrium(state, t[:, None, None])
    torque = state.joint_k * (target - joints)
    stored = 0.5 * (torque * (target - joints)).sum(axis=1)
    put_in = (0.5 * (torque[1:] + torque[:-1]) * np.diff(target, axis=0)).sum(axis=1)
    damping = np.array(scene.damping)[:, None]
    lost = (damping * np.diff(joints, axis=0) ** 2).sum(axis=1) / np.diff(t)[:, None]
    held = stored[1:] + np.cumsum(lost, axis=0)
    moving = 0.5 * sum(i * r * r for i, r in zip(scene.inertia, scene.rate, strict=False))
    work = stored[0] + moving + np.cumsum(put_in, axis=0)
    made = ~(held <= work + ENERGY_MADE * np.cumsum(np.abs(put_in), axis=0) + 1e-9)
    if made.any():
        i = int(np.argmax(made.any(axis=0)))
        k = int(np.argmax(made[:, i]))
        raise EdgeError(
            f"{scene.name}: trial {state.trials[i].number} of {state.trials[i].key} makes energy: "
            f"at {t[k + 1]:g} s the arm holds or has lost {held[k, i]:.3g} J, and {work[k, i]:.3g} "
            "J have been put in; give [step_s] a smaller step, or the object less extreme values"
        )


READ_AT_ONCE = 4
"""Trials whose frames stay in a processor's cache while one sensor's effect follows the other."""


def read_out(physics: PhysicsRun, plan: Plan, wanted: NDArray[np.bool_] | None = None) -> Batch:
    """The batch as a plan's sensor and clock show it.

    One run serves any plan that differs in these alone, as long as each of them has some: the
    frames are kept in whole counts where no sensor's effect is called for.

    Args:
        wanted: (n,) trials to read; the others' counts are zero.
    """
    state, frames = physics.state, physics.frames
    n = state.n
    shape = (n, len(frames.window[0]), state.skin.rows, state.skin.cols)
    counts, joints = np.zeros(shape, dtype=np.uint16), np.empty_like(physics.joints)
    found: dict[str, Any] = dict.fromkeys(("times", "kept", "valid"))
    which = np.arange(n) if wanted is None else np.flatnonzero(wanted)
    for some in np.split(which, range(READ_AT_ONCE, len(which), READ_AT_ONCE)):
        readings = Readings(
            seed=state.scene.seed,
            trials=tuple(state.trials[i] for i in some),
            t=physics.t,
            counts=frames.whole(state, some),
            joints=physics.joints[some],
        )
        for function in (*plan.clock, *plan.sensor):
            function(readings)
        counts[some], joints[some] = frames.in_counts(readings.counts), readings.joints
        for name in found:
            part = getattr(readings, name)
            if part is not None:
                if found[name] is None:
                    found[name] = np.zeros((n, *part.shape[1:]), dtype=part.dtype)
                found[name][some] = part
    return Batch(
        trials=state.trials,
        t=physics.t,
        counts=counts,
        joints=joints,
        force=physics.force,
        traces=physics.traces,
        state=state,
        **found,
    )
