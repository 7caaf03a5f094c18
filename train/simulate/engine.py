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
    FRAME,
    PACE,
    SAMPLE,
    SENSOR,
    SETUP,
    STEP,
    TRACE,
    TRACTION,
    TUNE,
    Plan,
    make_plan,
)
from train.simulate.readings import FULL, Readings
from train.simulate.scene_model import Scene, TrialSpec, Value
from train.simulate.schema import STIFFNESSES
from train.simulate.trials import Batch, Trials

MOST_TRIALS = 400
"""Most trials simulated side by side. Larger batches save little, as their arrays no
longer fit into a processor's cache."""
MOST_FRAMES = 400_000
"""Most frames of all trials simulated side by side; each takes about 1 kB of memory."""
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
    groups: dict[tuple[str, int], list[int]] = {}
    for i, trial in enumerate(specs):
        groups.setdefault((trial.key, trial.attempt), []).append(i)
    out: dict[str, Array] = {}
    for places in groups.values():
        for name, numbers in _values(scene, [specs[i] for i in places]).items():
            out.setdefault(name, np.full(len(specs), np.nan))[places] = numbers
    return out


def _values(scene: Scene, trials: list[TrialSpec]) -> dict[str, Any]:
    """The values of trials that share streams: same object, condition and number of
    redraws."""
    first = trials[0]
    numbers = np.array([trial.number for trial in trials])
    values = {
        **first.object.values,
        **scene.values,
        **PLACED,
    }
    suffix = f".{first.attempt}" if first.attempt else ""

    def drawn(name: str, kind: str) -> Array:
        return streams.draws(scene.seed, name + suffix, first.key, numbers, kind)

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


def batch_size(scene: Scene) -> int:
    """Number of a scene's trials that are simulated side by side."""
    return max(1, min(MOST_TRIALS, MOST_FRAMES // scene.frame_count))


def begin(
    scene: Scene,
    specs: tuple[TrialSpec, ...],
    *,
    plan: Plan | None = None,
) -> Batch:
    """Trials before their first step, with the hooks of a plan (None makes it).

    Raises:
        InputError: an object touches the arm before it moves.
    """
    batch = Batch(
        scene,
        specs,
        values_of(scene, specs),
        plan or make_plan(scene, specs),
    )
    t = batch.everyone
    t.run(*SETUP, *TUNE, *FRAME)
    contact = t.contact
    contact.y = contact.y_frame
    contact.compliance = np.zeros_like(contact.compliance)
    touches = t.solve_loads(contact.free_depth, np.zeros(len(t)))[0] > 0.0
    if touches.any():
        i = int(np.argmax(touches))
        trial = specs[i]
        yaw = abs(t.values["yaw_deg"][i])
        raise InputError(
            f"{scene.name}: object {trial.object.name!r} touches the arm before it "
            f"moves, in trial {trial.number} of {trial.key}, where the face is turned "
            f"by {yaw:.0f} degrees; give spread.yaw_deg or the object's width_m less, "
            "or trials.lead_s more time"
        )
    return batch


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
        shear: (n, frames, rows, C, 2) likewise of the tangential load, if there is any.
        trials: their state after the last step.
    """

    t: Array
    joints: Array
    force: Array
    traces: dict[str, Array]
    window: NDArray[np.float32]
    shear: NDArray[np.float32] | None
    trials: Batch

    @classmethod
    def of(cls, batch: Batch, *, images: bool) -> Self:
        """A run before its first step, with the joints at the start."""
        n = batch.n
        frames = batch.scene.frame_count
        shape = n, frames if images else 0, *batch.touch.image.shape[:2]
        shears = bool(batch.plan.stages[TRACTION])
        run = cls(
            t=np.arange(frames) / batch.scene.rate_hz,
            joints=np.empty((n, frames, len(batch.arm.q))),
            force=np.zeros((n, frames)),
            traces={},
            window=np.zeros(shape, dtype=np.float32),
            shear=np.zeros((*shape, 2), dtype=np.float32) if shears else None,
            trials=batch,
        )
        run.joints[:, 0] = batch.arm.q.T
        return run

    def take(self, ends: Trials) -> None:
        """Take in the frames of trials that end one."""
        at = ends.places, ends.clock.frame
        touched = ends.touch.force > 0.0
        self.joints[at] = ends.arm.q.T
        self.force[at] = ends.touch.force
        for call, t in ends.calls(TRACE):
            for name, values in call.function(t).items():
                if name not in self.traces:
                    self.traces[name] = np.zeros_like(self.force)
                self.traces[name][t.places, t.clock.frame] = values
        if self.window.size and touched.any():
            self._take_images(ends.only(touched))

    def _take_images(self, t: Trials) -> None:
        """Take in the images of trials that are touched."""
        scale = t.scene.skin.counts_per_newton
        counts = np.minimum(t.touch.image * scale, FULL)
        self.window[t.places, t.clock.frame] = np.moveaxis(counts, -1, 0)
        for call, rubbed in t.calls(TRACTION):
            loads = call.function(rubbed) * scale
            assert self.shear is not None
            image = np.moveaxis(loads, (0, -1), (-1, 0))
            self.shear[rubbed.places, rubbed.clock.frame] = image


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
    batch = begin(scene, specs, plan=plan)
    run = PhysicsRun.of(batch, images=images)
    last = len(run.t) - 1
    active = starts = batch.everyone
    while len(active):
        if len(starts):
            start_frames(starts)
        active.run(*STEP)
        active.clock.steps_left -= 1
        ends = active.only(active.clock.steps_left == 0)
        if len(ends):
            ends.clock.frame += 1
            # A frame ends at its own time: sums of steps would drift from it.
            ends.clock.t = ends.clock.frame / scene.rate_hz
            ends.run(*SAMPLE)
            run.take(ends)
            active = active.only(active.clock.frame < last)
        starts = ends.only(ends.clock.frame < last)
    lost = np.count_nonzero(batch.bed.lost)
    if lost:
        raise EdgeError(
            f"{scene.name}: the forearm's tilt was not found in {lost} trials; give "
            "skin.taxel_n_m, the object's stiffness or [step_s] less extreme values"
        )
    check_energy(batch, run.joints, run.t)
    return run


def start_frames(starts: Trials) -> None:
    """Choose the step of trials' next frame, and locate their contacts."""
    clock = starts.clock
    before = clock.steps.copy()
    starts.run(*PACE)
    changed = clock.steps != before
    if changed.any():
        changed_starts = starts.only(changed)
        rate_hz = starts.scene.rate_hz * changed_starts.clock.steps
        changed_starts.clock.h = np.asarray(1.0 / rate_hz, dtype=float)
        changed_starts.run(*TUNE)
    starts.run(*FRAME)
    clock.steps_left = clock.steps


def check_energy(batch: Batch, joints: Array, times: Array) -> None:
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
    scene = batch.scene
    k = batch.joints.stiffness.T
    # A scene of an arm without inertia need not give one.
    moving = 0.5 * np.dot(scene.inertia or np.zeros(len(k.T)), batch.arm.rate**2)
    way_s = np.minimum(times[:, None], batch.arm.travel_s.T[:, None])
    targets = batch.arm.start.T[:, None] + batch.arm.rate.T[:, None] * way_s
    torque = k * (targets - joints)
    stored = (0.5 * torque * (targets - joints)).sum(axis=2)
    put_in = (0.5 * (torque[:, 1:] + torque[:, :-1]) * np.diff(targets, axis=1)).sum(
        axis=2
    )
    turned = (
        batch.joints.damping.T * np.diff(joints, axis=1) ** 2 / np.diff(times)[:, None]
    )
    work, both_ways, lost = (
        np.pad(np.add.accumulate(energy, axis=1), ((0, 0), (1, 0)))
        for energy in (put_in, np.abs(put_in), turned.sum(axis=2))
    )
    energy_out = stored + lost
    energy_in = stored[:, :1] + moving[:, None] + work
    gains = ~(energy_out <= energy_in + ENERGY_MADE * both_ways + 1e-9)
    if gains.any():
        i = int(np.argmax(gains.any(axis=1)))
        frame = int(np.argmax(gains[i]))
        raise EdgeError(
            f"{scene.name}: trial {batch.specs[i].number} of {batch.specs[i].key} "
            f"makes energy: at {times[frame]:g} s the arm has stored or lost "
            f"{energy_out[i, frame]:.3g} J of the {energy_in[i, frame]:.3g} J put in; give "
            "[step_s] a smaller step, or the object less extreme values"
        )


def readings(
    physics: PhysicsRun,
    which: Places | None = None,
) -> Iterator[Readings]:
    """The sensor readings of a run's trials, trial by trial; `which` chooses some of
    them."""
    batch = physics.trials
    scene = batch.scene
    plan = batch.plan
    places = np.arange(batch.n) if which is None else which

    def on_skin(window: NDArray[np.float32], i: int) -> NDArray[np.float32]:
        shape = len(physics.t), *scene.skin.shape, *window.shape[4:]
        image = np.zeros(shape, dtype=np.float32)
        image[:, :, batch.bed.columns[:, i]] = window[i]
        return image

    for i in places.tolist():
        reading = Readings(
            scene=scene,
            trial=batch.specs[i],
            effects=plan.effects[i],
            which=i,
            t=physics.t,
            counts=on_skin(physics.window, i),
            joints=physics.joints[i].copy(),
            tangential=None if physics.shear is None else on_skin(physics.shear, i),
        )
        for stage in SENSOR:
            for call in plan.stages[stage]:
                if call.which[i]:
                    call.function(reading)
        yield reading
