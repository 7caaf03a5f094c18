"""The trials that run side by side: arrays whose last axis is the trial."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Array, Kinematics
from train.simulate.contact import bed_law, by_depth
from train.simulate.plan import ALL, Index, Plan
from train.simulate.scene_model import Cylinder, Scene, TrialSpec

WINDOW_HALF = 6
"""Columns to either side of the one that meets the object: +-90 degrees, beyond which a
cylinder has no more surface to press."""


def pick(values: NDArray[Any], i: Index) -> NDArray[Any]:
    """The values (..., n) of some trials, to read; of all of them it is the array itself."""
    return values if i is ALL else values.take(i, axis=-1)


@dataclass
class Trials:
    """n trials of a scene, from the setup to their last step.

    The attributes below are what all trials have. An effect keeps state of its own in `own`, a
    small dataclass whose arrays end in the trial axis too; without the effect it does not exist.

    Attributes:
        values: {name: (n,)} of what was drawn for each trial.
        plan: the hooks that run.
        own: {effect: its state}.
        usual, steps, left: (n,) of a frame: its steps where nothing happens, its steps now, and
            those that are still to come. Each trial has a clock of its own.
        frame, t, h: (n,) frames ended, seconds now, and seconds of a step.
        start, rate, travel_s: (dof, n), (dof, 1), (dof, n): the equilibrium point's angles at
            t = 0, its speed, and for how long it moves.
        lag: (dof, 1) radians by which a joint trails its equilibrium point in free motion.
        damping, joint_k: (dof, 1) of each joint.
        held, give: (dof, n) what holds a joint within a step, and the compliance of all that.
        q, q_free, q_frame: (dof, n) joint angles: now, after the step without load, at the frame.
        point, normal, face, along_face: (3, n) the point of the forearm's axis beside the
            contact; of the object's face its normal, a point, and its direction along the forearm.
        z: (n,) metres in the skin's link, where the object is met.
        y, y_frame, depth, loads: (2, n) the contact's coordinates (`contact`) without load, at the
            frame and under load, and the loads.
        soft: (n,) metres that the object gives way for each newton in this step.
        compliance: (3, n) of the arm in them; jacobian: (dof, 2, n) how the joints move them.
        row_z: (rows, 1) metres in the skin's link, of its rows.
        columns: (C, n) of the skin that can touch; column_gaps: (C, n) metres that each lies
            back at zero depth; reach: (C, n) the part of it that the face can touch.
        taxel_k: (n,) newtons a metre of a taxel and what is in series with it.
        gaps, stiffness: (S, n) the springs of a row: metres at which each is touched, newtons a
            metre; a trial of fewer springs has some at infinity, of no stiffness.
        law_gaps, slopes, intercepts: (E, n) a bed's law max_s (K_s a - B_s), by its gaps.
        weight, line_gap, line_depth: (rows, n) the part of each row that the face covers, metres
            by which the face draws back there, and how deep it is pressed.
        row_force: (rows, n) newtons that the rows bore in the last step; a forearm that does not
            pivot has the whole in its first row.
        lost: (n,) whether a contact's loads were not found.
        force, deepest, inside: (n,) of a frame: the newtons borne, the depth of its deepest row,
            and the same of the nearest row where none touches, below 0.
        image: (rows, C, n) newtons on each taxel.
    """

    scene: Scene
    specs: tuple[TrialSpec, ...]
    values: dict[str, Array]
    plan: Plan
    own: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Zeros for all that is said above."""
        skin, n, dof = self.skin, len(self.specs), len(self.scene.stiffness)
        rate_hz, zeros = self.scene.trials["rate_hz"], np.zeros
        self.n, self.rate_hz = n, rate_hz
        self.rows, window = skin.rows, 2 * min(WINDOW_HALF, (skin.cols - 1) // 2) + 1
        self.usual = np.array(
            [max(1, round(1.0 / (rate_hz * spec.step_s))) for spec in self.specs], dtype=np.int64
        )
        self.steps, self.left, self.frame = self.usual.copy(), *zeros((2, n), dtype=np.int64)
        self.t, self.h = zeros(n), 1.0 / (rate_hz * self.usual)
        self.damping = np.array(self.scene.damping)[:, None]
        self.joint_k = np.array(self.scene.stiffness)[:, None]
        self.rate = np.array(self.scene.rate)[:, None]
        self.lag = self.damping / self.joint_k * self.rate
        self.start, self.travel_s, self.held, self.give = zeros((4, dof, n))
        self.q, self.q_free, self.q_frame = zeros((3, dof, n))
        self.point, self.normal, self.face, self.along_face = zeros((4, 3, n))
        self.axes, self.origins, self.jacobian = *zeros((2, 3, dof, n)), zeros((dof, 2, n))
        self.along = zeros((3, n))
        self.y, self.y_frame, self.depth, self.loads = zeros((4, 2, n))
        self.compliance = zeros((3, n))
        self.row_z = skin.row0_z_m - skin.row_pitch_m * np.arange(skin.rows, dtype=float)[:, None]
        self.columns = zeros((window, n), dtype=np.intp)
        self.column_gaps, self.reach = zeros((2, window, n))
        self.gaps, self.stiffness = zeros((2, 0, n))
        self.weight, self.line_gap, self.line_depth, self.row_force = zeros((4, skin.rows, n))
        self.law_gaps, self.slopes, self.intercepts = np.full((1, n), np.inf), *zeros((2, 1, n))
        self.lost = zeros(n, dtype=bool)
        self.soft, self.z, self.taxel_k, self.force, self.deepest, self.inside = zeros((6, n))
        self.image = zeros((skin.rows, window, n))

    @property
    def skin(self) -> Cylinder:
        """The skin's shape."""
        return self.scene.cylinder

    @property
    def kinematics(self) -> Kinematics:
        """The arm's."""
        return self.scene.kinematics

    def equilibrium(self, t: Any, i: Index = ALL) -> Array:
        """(dof, n) equilibrium angles of some trials at their times (n,)."""
        moved = self.rate * np.minimum(t, pick(self.travel_s, i))
        return np.asarray(pick(self.start, i) + moved)

    def add_springs(self, i: Index, gaps: Array, stiffness: Array) -> None:
        """Put further springs (S, n of i) into each row's bed, of some trials."""
        more, none = np.full((len(gaps), self.n), np.inf), np.zeros((len(gaps), self.n))
        more[:, i], none[:, i] = np.where(stiffness > 0.0, gaps, np.inf), stiffness
        self.gaps = np.concatenate([self.gaps, more])
        self.stiffness = np.concatenate([self.stiffness, none])

    def obey(self, i: Index, gaps: Array, stiffness: Array) -> NDArray[np.intp]:
        """Give some trials the law of springs (E, n of i); (E, n of i) their order by depth."""
        order, gaps, stiffness = by_depth(gaps, stiffness)
        short = len(gaps) - len(self.law_gaps)
        if short > 0:
            self.law_gaps = np.pad(self.law_gaps, ((0, short), (0, 0)), constant_values=np.inf)
            self.slopes, self.intercepts = (
                np.pad(law, ((0, short), (0, 0))) for law in (self.slopes, self.intercepts)
            )
        self.law_gaps[: len(gaps), i] = gaps
        self.slopes[: len(gaps), i], self.intercepts[: len(gaps), i] = bed_law(gaps, stiffness)
        return order

    def ask(self, i: Index, y: Array, c: Array) -> Array:
        """(2, n of i) the loads of some trials' contacts.

        Args:
            y, c: (n of i) the depth without load, and metres that it gives way for each newton, in
                place of the trials' own.
        """
        calls = self.plan.stages["answer"]
        if len(calls) == 1:
            return np.asarray(calls[0].function(self, i, y, c))
        trials = np.arange(self.n) if i is ALL else i
        found = np.zeros((2, len(trials)))
        for call in calls:
            at = call.which[trials].nonzero()[0]
            if at.size:
                found[:, at] = call.function(self, trials[at], y[at], c[at])
        return found
