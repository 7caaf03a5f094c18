"""Runs trials side by side: draws their values, sets them up, steps them and reads
their sensors.

Each trial has its own clock. A round of the loop takes one step of every unfinished
trial, and each trial ends a frame after as many steps as that frame has. So only the
trials near a jolt take finer steps, and trials of different steps share one loop.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from edge.errors import EdgeError, InputError
from train.simulate import streams
from train.simulate.arm import Array, Places
from train.simulate.plan import (
    ALL,
    FRAME,
    PACE,
    SAMPLE,
    SENSOR,
    SETUP,
    STEP,
    TUNE,
    Plan,
    make_plan,
    module_of,
)
from train.simulate.readings import FULL, Readings
from train.simulate.scene_model import Scene, TrialSpec, Value
from train.simulate.schema import STIFFNESSES
from train.simulate.trials import Trials

ENERGY_MADE = 0.01
"""Tolerance as a part of the work put in, since frames only sample that work."""
SCALED = {
    "stiffness": STIFFNESSES,
    "friction": ("friction_static", "friction_kinetic"),
    "mass": ("mass_kg",),
    "cover": ("taxel_n_m", "cover_n_m"),
}
"""{spread: the values that it scales}; any other spread is added to the value of its
name."""
PLACED = dict.fromkeys(("place_m", "yaw_deg", "roll_deg"), Value(0.0, 0.0))
"""Where the forearm meets an object: spreads around 0 for which objects have no
value."""


def values_of(scene: Scene, specs: tuple[TrialSpec, ...]) -> dict[str, Array]:
    """{name: (n,)} of every value and spread; a trial's draws depend on nothing but
    itself.

    A value that an object does not have, such as the mass of a fixed one, is NaN and
    never read.
    """
    streamed = [(trial.key, trial.attempt) for trial in specs]
    out: dict[str, Array] = {}
    for group in dict.fromkeys(streamed):
        members = [i for i, stream in enumerate(streamed) if stream == group]
        for name, numbers in _values(scene, [specs[i] for i in members]).items():
            out.setdefault(name, np.full(len(specs), np.nan))[members] = numbers
    return out


def _values(scene: Scene, trials: list[TrialSpec]) -> dict[str, Any]:
    """The values of trials that share streams: same object, condition and number of
    redraws."""
    first = trials[0]
    numbers = np.array([trial.number for trial in trials])
    values = {
        **first.object.values,
        "lead_s": scene.lead,
        "taxel_n_m": scene.taxel_n_m,
        **PLACED,
    }
    again = f".{first.attempt}" if first.attempt else ""

    def drawn(name: str, kind: str) -> Array:
        return streams.draws(scene.seed, name + again, first.key, numbers, kind)

    out: dict[str, Any] = {name: value.low for name, value in values.items()}
    for name, value in values.items():
        if value.high > value.low:
            out[name] = value.low + (value.high - value.low) * drawn(
                f"value.{name}", "random"
            )
    for spread, deviation in scene.spread.items():
        if deviation:
            away = deviation * drawn(f"spread.{spread}", "standard_normal")
            if spread in out:
                out[spread] = out[spread] + away
            for name in out.keys() & SCALED.get(spread, ()):
                out[name] = out[name] * np.exp(away)
    return out


def frame_count(scene: Scene) -> int:
    """Number of frames of a trial: the longest lead, the time after it, and the frame
    at t = 0."""
    return round((scene.lead.high + scene.trials["after_s"]) * scene.rate_hz) + 1


def begin(
    scene: Scene, specs: tuple[TrialSpec, ...], *, plan: Plan | None = None
) -> Trials:
    """Trials before their first step, with the hooks of a plan (None makes it).

    Raises:
        InputError: an object touches the arm before it moves.
    """
    t = Trials(scene, specs, values_of(scene, specs), plan or make_plan(scene, specs))
    t.plan.run((*SETUP, *TUNE, *FRAME), t)
    t.y[:] = t.y_frame
    t.compliance[:] = 0.0
    touches = t.ask(ALL, t.y[0], t.compliance[0])[0] > 0.0
    if touches.any():
        i = int(np.argmax(touches))
        trial = t.specs[i]
        yaw = abs(t.values["yaw_deg"][i])
        raise InputError(
            f"{scene.name}: object {trial.object.name!r} touches the arm before it "
            "moves, in "
            f"trial {trial.number} of {trial.key}, where the face is turned by "
            f"{yaw:.0f} degrees; "
            "give spread.yaw_deg or the object's width_m less, or trials.lead_s more "
            "time"
        )
    return t


@dataclass(frozen=True)
class PhysicsRun:
    """The physics of n trials: the load on their skin, before any sensor reads it.

    Attributes:
        t: (frames,) seconds.
        joints: (n, frames, dof) radians.
        force: (n, frames) newtons.
        traces: {name: (n, frames)} that effects keep, such as `slide_m`.
        window: (n, frames, rows, C) counts on the columns that can touch; no frames
            where the run made no images.
        images: {effect: (n, frames, rows, C, images)} likewise, of effects that have
            `IMAGES`.
        trials: their state after the last step.
    """

    t: Array
    joints: Array
    force: Array
    traces: dict[str, Array]
    window: NDArray[np.float32]
    images: dict[str, NDArray[np.float32]]
    trials: Trials


def run_physics(
    scene: Scene,
    specs: tuple[TrialSpec, ...],
    *,
    plan: Plan | None = None,
    images: bool = True,
) -> PhysicsRun:
    """The physics of trials run side by side, each with the same bits as it has alone.

    Args:
        plan: as of `begin`.
        images: False leaves out the load on the taxels.

    Raises:
        InputError: as of `begin`.
        EdgeError: the solver did not find a contact's loads, or a trial gained energy.
    """
    t = begin(scene, specs, plan=plan)
    frames = frame_count(scene)
    log = _Log.of(t, frames, images=images)
    active = np.arange(t.n)
    while active.size:
        starts = active[t.left[active] == 0]
        if starts.size:
            start_frames(t, starts)
        t.plan.run(STEP, t, active)
        t.left[active] -= 1
        ends = active[t.left[active] == 0]
        if not ends.size:
            continue
        t.frame[ends] += 1
        k = t.frame[ends]
        # A frame ends at its own time: sums of steps would drift from it.
        t.t[ends] = k / t.rate_hz
        t.plan.run(SAMPLE, t, ends)
        log.take(t, ends, k)
        if (k == frames - 1).any():
            active = active[t.frame[active] < frames - 1]
    if t.lost.any():
        raise EdgeError(
            f"{scene.name}: the forearm's tilt was not found in "
            f"{np.count_nonzero(t.lost)} trials; give skin.taxel_n_m, the object's "
            "stiffness or [step_s] less extreme values"
        )
    times = np.arange(frames) / scene.rate_hz
    check_energy(t, log.joints, times)
    return PhysicsRun(
        times, log.joints, log.force, log.traces, log.window, log.images, t
    )


@dataclass(frozen=True)
class _Log:
    """The frames of a run, as it keeps them; see `PhysicsRun`.

    Attributes:
        joints, force, traces, window, images: of `PhysicsRun`.
        sources: {trace: the object that holds its value, and the attribute}.
        further: {effect: the attributes of its images}.
        images_wanted: whether any images are kept.
    """

    joints: Array
    force: Array
    traces: dict[str, Array]
    window: NDArray[np.float32]
    images: dict[str, NDArray[np.float32]]
    sources: dict[str, tuple[Any, str]]
    further: dict[str, tuple[str, ...]]
    images_wanted: bool

    @classmethod
    def of(cls, t: Trials, frames: int, *, images: bool) -> Self:
        """An empty log, with the joints at the start."""
        sources: dict[str, tuple[Any, str]] = {"depth_m": (t, "deepest")}
        for effect in t.plan.calls:
            for name, attribute in getattr(module_of(effect), "TRACES", {}).items():
                sources[name] = t.states[effect], attribute
        shape = t.n, frames if images else 0, *t.image.shape[:2]
        further = images_of(t) if images else {}
        log = cls(
            joints=np.empty((t.n, frames, len(t.q))),
            force=np.zeros((t.n, frames)),
            traces={name: np.zeros((t.n, frames)) for name in sources},
            window=np.zeros(shape, dtype=np.float32),
            images={
                effect: np.zeros((*shape, len(names)), dtype=np.float32)
                for effect, names in further.items()
            },
            sources=sources,
            further=further,
            images_wanted=images,
        )
        log.joints[:, 0] = t.q.T
        return log

    def take(self, t: Trials, ends: Places, k: NDArray[np.int64]) -> None:
        """Take in the frames k of the trials that end one."""
        self.joints[ends, k] = t.q.T[ends]
        self.force[ends, k] = t.force[ends]
        for name, (owner, attribute) in self.sources.items():
            self.traces[name][ends, k] = getattr(owner, attribute)[ends]
        scale = t.skin.counts_per_newton
        if self.images_wanted:
            touched = t.force[ends] > 0.0
            counts = np.minimum(t.image.take(ends[touched], -1) * scale, FULL)
            self.window[ends[touched], k[touched]] = np.moveaxis(counts, -1, 0)
        for effect, names in self.further.items():
            for place, name in enumerate(names):
                loads = getattr(t.states[effect], name).take(ends, -1) * scale
                self.images[effect][ends, k, ..., place] = np.moveaxis(loads, -1, 0)


def images_of(t: Trials) -> dict[str, tuple[str, ...]]:
    """{effect: the attributes of its state that are images of their own}."""
    modules = {effect: module_of(effect) for effect in t.plan.calls}
    return {
        effect: module.IMAGES
        for effect, module in modules.items()
        if hasattr(module, "IMAGES")
    }


def start_frames(t: Trials, starts: Places) -> None:
    """Choose the step of some trials' next frame, and locate their contacts."""
    before = t.steps[starts]
    t.plan.run(PACE, t, starts)
    changed = starts[t.steps[starts] != before]
    if changed.size:
        t.h[changed] = 1.0 / (t.rate_hz * t.steps[changed])
        t.plan.run(TUNE, t, changed)
    t.plan.run(FRAME, t, starts)
    t.left[starts] = t.steps[starts]


def check_energy(t: Trials, joints: Array, times: Array) -> None:
    """Check that no trial gains energy.

    Only the motion of the equilibrium point puts energy in, W = int k (q_eq - q) dq_eq.
    The joints' damping takes at least d (dq)^2 / dt of it in each frame. So the arm's
    springs store at most the rest, plus the energy of the arm's motion at the start. A
    contact may give back the energy that it has taken, but no more. A step that makes
    energy breaks this bound at once.

    Args:
        joints: (n, frames, dof) radians.
        times: (frames,) seconds.

    Raises:
        EdgeError: a trial gains energy; the sentence names the first one.
    """
    scene = t.scene
    k = t.joint_k.T
    moving = 0.5 * sum(
        i * r * r for i, r in zip(scene.inertia, scene.rate, strict=False)
    )
    targets = t.start.T[:, None] + t.rate.T * np.minimum(
        times[:, None], t.travel_s.T[:, None]
    )
    torque = k * (targets - joints)
    stored = (0.5 * torque * (targets - joints)).sum(axis=2)
    put_in = (0.5 * (torque[:, 1:] + torque[:, :-1]) * np.diff(targets, axis=1)).sum(
        axis=2
    )
    turned = t.damping.T * np.diff(joints, axis=1) ** 2 / np.diff(times)[:, None]
    work, both_ways, lost = (
        np.pad(np.add.accumulate(energy, axis=1), ((0, 0), (1, 0)))
        for energy in (put_in, np.abs(put_in), turned.sum(axis=2))
    )
    held = stored + lost
    brought = stored[:, :1] + moving + work
    gains = ~(held <= brought + ENERGY_MADE * both_ways + 1e-9)
    if gains.any():
        i = int(np.argmax(gains.any(axis=1)))
        frame = int(np.argmax(gains[i]))
        raise EdgeError(
            f"{scene.name}: trial {t.specs[i].number} of {t.specs[i].key} makes "
            "energy: "
            f"at {times[frame]:g} s the arm has stored or lost {held[i, frame]:.3g} J "
            "of the "
            f"{brought[i, frame]:.3g} J put in; give [step_s] a smaller step, or the "
            "object less extreme values"
        )


def readings(
    physics: PhysicsRun, which: Places | None = None, scene: Scene | None = None
) -> Iterator[Readings]:
    """The sensor readings of a run's trials, trial by trial.

    Args:
        which: the trials to read; None for all.
        scene: a scene with other sensors, to read the run with these instead.
    """
    t = physics.trials
    scene = scene or t.scene
    every = np.arange(t.n) if which is None else which
    plan = t.plan if scene is t.scene else make_plan(scene, t.specs)
    for i in every.tolist():
        counts = np.zeros((len(physics.t), *t.skin.shape), dtype=np.float32)
        counts[:, :, t.columns[:, i]] = physics.window[i]
        images = {}
        for effect, window in physics.images.items():
            images[effect] = np.zeros((*counts.shape, window.shape[-1]), np.float32)
            images[effect][:, :, t.columns[:, i]] = window[i]
        reading = Readings(
            scene=scene,
            trial=t.specs[i],
            effects=plan.effects[i],
            which=i,
            t=physics.t,
            counts=counts,
            joints=physics.joints[i].copy(),
            images=images,
        )
        for stage in SENSOR:
            for call in plan.stages[stage]:
                if call.which[i]:
                    call.function(reading)
        yield reading
