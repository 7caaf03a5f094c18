"""Run a batch of trials through its plan."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.errors import EdgeError, InputError
from train.simulate import streams
from train.simulate.assemble import make_plan
from train.simulate.compiled import Array, each
from train.simulate.energy import check_energy
from train.simulate.plan import RUN_STAGES, Plan
from train.simulate.reader import Value
from train.simulate.readings import Readings
from train.simulate.required_effects import required_effects
from train.simulate.run_frames import run_frames
from train.simulate.scene_model import Scene, SceneObject, TrialSpec
from train.simulate.schema import STIFFNESSES
from train.simulate.sensor_frames import SensorFrames
from train.simulate.state import State


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


SCALED = {
    "stiffness": STIFFNESSES,
    "friction": ("friction_static", "friction_kinetic"),
    "mass": ("mass_kg",),
    "cover": ("taxel_n_m", "cover_n_m"),
}
"""{spread: the values it is a part of}; any other is added to the value of its own name."""
PLACED = dict.fromkeys(("place_m", "yaw_deg", "roll_deg"), Value(0.0, 0.0))
"""Where the forearm meets an object: spreads about 0, of which no object has a value."""


def values_of(scene: Scene, trials: tuple[TrialSpec, ...]) -> dict[str, Array]:
    """{name: (n,)} of every value and spread; a trial's draws depend on nothing but itself.

    Where an object has no such value (a fixed one its mass), it is NaN and nothing reads it.
    """
    groups: dict[tuple[str, int], list[int]] = {}
    for i, trial in enumerate(trials):
        groups.setdefault((trial.key, trial.attempt), []).append(i)
    out: dict[str, Array] = {}
    for members in groups.values():
        where = np.array(members)
        for name, drawn in _values(scene, [trials[i] for i in members]).items():
            if name not in out:
                out[name] = np.full(len(trials), np.nan)
            out[name][where] = drawn
    return out


def _values(scene: Scene, trials: list[TrialSpec]) -> dict[str, Any]:
    """Those of trials that share their streams: an object's in one condition, drawn as often."""
    first, numbers = trials[0], np.array([trial.number for trial in trials])
    values = {**first.object.values, "lead_s": scene.lead, "taxel_n_m": scene.taxel_n_m, **PLACED}
    out: dict[str, Any] = {name: value.low for name, value in values.items()}

    def draws(what: str, names: list[str], kind: str) -> Iterator[tuple[str, Array]]:
        again = f".{first.attempt}" if first.attempt else ""
        streamed = [f"{what}.{name}{again}" for name in names]
        found = streams.draws(scene.seed, streamed, first.key, numbers, kind)
        return zip(names, found, strict=True)

    for name, part in draws("value", [n for n, v in values.items() if v.varies], "uniform"):
        out[name] = out[name] + (values[name].high - values[name].low) * part
    spreads = [name for name, deviation in scene.spread.items() if deviation]
    for spread, away in draws("spread", spreads, "normal"):
        away *= scene.spread[spread]
        if spread in out:
            out[spread] = out[spread] + away
        for name in SCALED.get(spread, ()):
            if name in out:
                out[name] = out[name] * np.exp(away)
    return out


def frame_count(scene: Scene) -> int:
    """Frames of a trial: the longest lead, what follows, and the frame at t = 0."""
    duration = scene.lead.high + scene.trials["after_s"]
    return round(duration * scene.trials["rate_hz"]) + 1


def begin(
    scene: Scene, plan: Plan, trials: tuple[TrialSpec, ...], step_s: float, values: dict[str, Array]
) -> State:
    """The state of a batch before its first step; a whole number of steps makes a frame."""
    state = State(
        scene=scene,
        skin=scene.cylinder,
        trials=trials,
        n=len(trials),
        steps=max(1, round(1.0 / (scene.trials["rate_hz"] * step_s))),
        values=values,
        solve=plan.solve.address,
    )
    for function in plan.setup:
        function(state)
    each(plan.addresses("tune"), state.trial.here)
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
        images: False for forces, joints and traces alone; `counts` are then empty.
    """
    first = trials[0]
    plan = plan or make_plan(scene, kind_of(scene, first.object, first.condition).effects)
    physics = run_physics(scene, trials, step_s, plan=plan, values=values, images=images)
    seen = list(readings(physics, plan))

    def all_of(name: str) -> Any:
        found = [getattr(one, name) for one in seen]
        return None if found[0] is None else np.stack(found)

    found = {name: all_of(name) for name in ("joints", "times", "kept", "valid")}
    found["counts"] = np.stack([one.frames() for one in seen])
    force, traces = physics.force, physics.traces
    return Batch(trials, physics.t, force=force, traces=traces, state=physics.state, **found)


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
    state = begin(scene, plan, trials, step_s, values)
    check_start(state, plan)
    n, dof = len(trials), len(scene.stiffness)
    seen = SensorFrames(scene, plan, state, frames if images else 0)
    joints, force = np.empty((n, frames, dof)), np.zeros((n, frames))
    traces = np.zeros((len(plan.traces), n, frames))
    run_frames(
        state.records,
        tuple(plan.addresses(stage) for stage in RUN_STAGES),
        joints,
        force,
        seen.window,
        seen.scale,
        not seen.raw,
        state.places(list(plan.traces.values())),
        traces,
    )
    check_found(state)
    t = np.arange(frames) / scene.trials["rate_hz"]
    check_energy(state, joints, t)
    kept = dict(zip(plan.traces, traces, strict=True))
    return PhysicsRun(frames=seen, t=t, joints=joints, force=force, traces=kept, state=state)


def check_found(state: State) -> None:
    """Refuse a batch in which a contact's loads were not found.

    Raises:
        EdgeError: names the scene, and how many trials that was in.
    """
    if state.trial.lost.any():
        raise EdgeError(
            f"{state.scene.name}: how far the forearm tilts was not found in "
            f"{np.count_nonzero(state.trial.lost)} trials; "
            "give skin.taxel_n_m, the object's stiffness or [step_s] less extreme values"
        )


def check_start(state: State, plan: Plan) -> None:
    """Refuse a batch in which an object bears force before the arm has moved.

    Raises:
        InputError: names the first such trial, and by how much its face is turned.
    """
    t = state.trial
    each(plan.addresses("frame"), t.here)
    t.free, t.c = t.y_frame, 0.0
    each(np.array([state.solve]), t.here)
    held = t.found[:, 0] > 0.0
    if held.any():
        i = int(np.argmax(held))
        trial, yaw = state.trials[i], abs(state.values["yaw_deg"][i])
        raise InputError(
            f"{state.scene.name}: object {trial.object.name!r} touches the arm before it moves, in "
            f"trial {trial.number} of {trial.key}, where the face is turned by {yaw:.0f} degrees; "
            "give spread.yaw_deg or the object's width_m less, or trials.lead_s more time"
        )


def readings(
    physics: PhysicsRun, plan: Plan, which: NDArray[np.intp] | None = None
) -> Iterator[Readings]:
    """What a plan's sensor and clock show of a run's trials, one by one.

    One run serves any plan that differs in these alone, as long as each of them has some: the
    frames are kept in whole counts where no sensor's effect is called for.

    Args:
        which: the trials to read; None for all.
    """
    state = physics.state
    for i in range(state.n) if which is None else which.tolist():
        counts, taxels = physics.frames.borne(state, i)
        seen = Readings(
            seed=state.scene.seed,
            which=i,
            trial=state.trials[i],
            t=physics.t,
            counts=counts,
            taxels=taxels,
            shape=(state.skin.rows, state.skin.cols),
            joints=physics.joints[i].copy(),
        )
        for function in (*plan.clock, *plan.sensor):
            function(seen)
        yield seen
