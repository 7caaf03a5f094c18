"""What a batch of trials carries from step to step, and what its sensors make of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Kinematics, Pose
from train.simulate.contact import Array, Coordinates, Springs
from train.simulate.scene_model import Cylinder, Scene, TrialSpec

Own = TypeVar("Own")


@dataclass
class Bed:
    """The springs between skin and object: L lines (rows, or stems) of C springs (columns).

    Attributes:
        gaps: (C, n) metres at which a spring is touched, at zero depth of its line.
        stiffness: (C, n) newtons a metre.
        weight: (L, n) the part of each line that the object covers.
        line_gap: (L, n) metres by which the object's face draws back; (1, n) where it is flat.
        slopes, intercepts: (E, n) the law of the whole bed, phi(a) = max_s (K_s a - B_s).
    """

    gaps: Array
    stiffness: Array
    weight: Array
    line_gap: Array
    slopes: Array = field(init=False)
    intercepts: Array = field(init=False)

    def lines_of(self, springs: Springs, lever: Array) -> Springs:
        """The bed's springs with its lines as they are now, at their levers (L, n)."""
        return springs._replace(weight=self.weight, line_gap=self.line_gap, lever=lever)


@dataclass
class State:
    """A batch of n trials, from its first step to its last.

    The base's functions set what is declared here; an effect keeps a dataclass of its own
    (`own`), so the state of an effect that is not called for does not exist.

    Attributes:
        h: seconds, the step.
        frame: (n,) the number of the frame that has ended last.
        t: seconds; (n,) once a frame has ended.
        values: {name: (n,)} of what was drawn for each trial.
        solve: (state, y, C) -> the loads at which arm and bed agree.
        own: {class: instance}, the called effects' own state.
        start, rate: (dof, n) and (dof, 1), the equilibrium point at t = 0 and its speed.
        lag: (dof, 1) radians by which a joint trails its equilibrium point in free motion.
        travel_s: (dof, n) seconds for which the equilibrium point moves.
        held, give, joint_k: (dof, 1) of a joint's step: what damping holds, the compliance
            of the whole, the spring.
        q, q_free, q_frame: (dof, n) radians: now, after the step without load, at the frame.
        point: (3, n) metres on the forearm's axis, beside the middle of the contact.
        approach: (n,) m/s along the push before the contact.
        normal, face, along_face: (3, n) the object's face: its normal, a point, the direction
            along the forearm.
        y, y_frame, loads, compliance, jacobian, depth: of the contact's coordinates
            (`contact`).
        force: (n,) newtons that the skin bears.
        image: (rows, columns, n) newtons a taxel, of the skin's rows and of `columns`.
    """

    scene: Scene
    skin: Cylinder
    trials: tuple[TrialSpec, ...]
    n: int
    h: float | Array
    values: dict[str, Array]
    kinematics: Kinematics
    solve: Solver
    own: dict[type, Any] = field(default_factory=dict)

    frame: Array = field(init=False)
    t: float | Array = 0.0
    travel_s: Array = field(init=False)
    start: Array = field(init=False)
    lag: Array = field(init=False)
    rate: Array = field(init=False)
    held: Array = field(init=False)
    give: Array = field(init=False)
    joint_k: Array = field(init=False)
    q: Array = field(init=False)
    q_free: Array = field(init=False)
    q_frame: Array = field(init=False)
    pose: Pose = field(init=False)
    point: Array = field(init=False)

    row_z: Array = field(init=False)
    z: Array = field(init=False)
    approach: Array = field(init=False)
    normal: Array = field(init=False)
    face: Array = field(init=False)
    along_face: Array = field(init=False)
    meeting_angle: Array = field(init=False)
    columns: NDArray[np.intp] = field(init=False)
    column_gaps: Array = field(init=False)
    reach: Array = field(init=False)
    taxel_k: Array = field(init=False)
    bed: Bed = field(init=False)

    y: Coordinates = field(init=False)
    y_frame: Coordinates = field(init=False)
    jacobian: Coordinates = field(init=False)
    compliance: Coordinates = field(init=False)
    loads: Coordinates = field(init=False)
    depth: Coordinates = field(init=False)

    force: Array = field(init=False)
    line_depth: Array = field(init=False)
    image: Array = field(init=False)

    def of(self, kind: type[Own]) -> Own:
        """An effect's own state."""
        return cast(Own, self.own[kind])

    def keep(self, own: object) -> None:
        """Put an effect's own state where `of` finds it."""
        self.own[type(own)] = own


Kept = tuple[NDArray[Any], Callable[[State], Array]]
"""Room (frames, ...) for a quantity of every frame, and what it is in a state."""
Solver = Callable[[State, Coordinates, Coordinates], Coordinates]


@dataclass
class Readings:
    """What the sensors of a batch read, all frames at once.

    Attributes:
        seed: the scene's.
        t: (frames,) seconds.
        counts: (n, frames, rows, cols), float32 until every sensor effect has run.
        joints: (n, frames, dof) radians.
        times: (n, frames) seconds, where a clock effect shifts them.
        kept: (n, frames) bool, where frames are lost.
        valid: (n, rows, cols) bool, where taxels are known to be dead.
    """

    seed: int
    trials: tuple[TrialSpec, ...]
    t: Array
    counts: NDArray[Any]
    joints: Array
    times: Array | None = None
    kept: NDArray[np.bool_] | None = None
    valid: NDArray[np.bool_] | None = None
