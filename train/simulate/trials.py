"""The state of trials that run side by side, in arrays whose last axis is the trial."""

from dataclasses import dataclass, field, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Array, Mask, Places
from train.simulate.contact import bed_law, by_depth, total
from train.simulate.plan import ALL, Index, Plan
from train.simulate.scene_model import Scene, TrialSpec

__all__ = ["ALL", "Array", "Index", "Mask", "Places", "Trials", "pick", "total"]
WINDOW_HALF = 6
"""Columns on either side of the one that meets the object: +-90 degrees, beyond which a
cylinder has no surface to press."""


def pick(values: NDArray[Any], i: Index) -> NDArray[Any]:
    """The values (..., n) of some trials, to read; for `ALL`, the array itself."""
    return values if i is ALL else values.take(i, axis=-1)


@dataclass
class Trials:
    """n trials of a scene, from the setup to their last step.

    These attributes belong to all trials. An effect keeps its own state in `states`, as a
    small dataclass whose arrays also end in the trial axis; without the effect it does
    not exist.

    Attributes:
        values: {name: (n,)} the values drawn for each trial.
        plan: the hooks to run.
        states: {effect: its state}.
        usual, steps, left: (n,) the number of steps in a frame away from jolts, in the
            present frame, and still to come in it.
        frame, t, h: (n,) number of frames ended, seconds now, and seconds of a step.
            Each trial has its own clock.
        start, rate, travel_s: (dof, n), (dof, 1), (dof, n): the equilibrium point's
            angles at t = 0, its speed, and for how long it moves.
        lag: (dof, 1) radians by which a joint trails its equilibrium point in free
            motion.
        damping, joint_k: (dof, 1) of each joint.
        held, give: (dof, n) stiffness of a joint's damping and inertia within a step,
            and the compliance of the joint with it.
        q, q_free, q_frame: (dof, n) joint angles: now, after the step without load, at
            the frame.
        point, normal, face, along_face: (3, n) the point of the forearm's axis beside
            the contact; of the object's face its normal, a point, and its direction
            along the forearm.
        z: (n,) metres in the skin's link, where the object is met.
        y, y_frame, depth, loads: (2, n) the contact's coordinates (`contact`) without
            load, at the frame and under load, and its loads.
        soft: (n,) metres that the object gives way for each newton in this step.
        compliance, jacobian: (3, n), (dof, 2, n) the arm's compliance in these
            coordinates, and how the joints move them.
        row_z: (rows, 1) metres of each row in the skin's link.
        columns, column_gaps, reach: (C, n) the skin's columns that can touch, the gap
            of each in metres at zero depth, and the part of it that the face can touch.
        column_angle: (C, n) radians from the push to each of these columns, positive
            towards higher columns.
        taxel_k: (n,) newtons a metre of a taxel with the springs in series.
        gaps, stiffness: (S, n) the springs of a row: metres at which each is touched,
            and newtons a metre. A trial of fewer springs has some at infinity, of no
            stiffness.
        law_gaps, slopes, intercepts: (E, n) a bed's law max_s (K_s a - B_s), by its
            gaps.
        weight, line_gap, line_depth: (rows, n) the part of each row that the face
            covers, metres by which the face draws back there, and metres of its depth.
        row_force: (rows, n) newtons on each row in the last step; where the forearm
            does not pivot, the first row holds the sum.
        lost: (n,) whether the solver failed to find a contact's loads.
        force, deepest, inside: (n,) at a frame: newtons on the skin, depth of the
            deepest row, and the same but negative where no row touches.
        image: (rows, C, n) newtons on each taxel.
    """

    scene: Scene
    specs: tuple[TrialSpec, ...]
    values: dict[str, Array]
    plan: Plan
    states: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Fill the attributes above with zeros."""
        self.skin = self.scene.skin
        self.kinematics = self.scene.kinematics
        skin = self.skin
        n = len(self.specs)
        dof = len(self.scene.stiffness)
        rate_hz = self.scene.trials["rate_hz"]
        zeros = np.zeros
        self.n = n
        self.rate_hz = rate_hz
        self.rows, window = skin.rows, 2 * min(WINDOW_HALF, (skin.cols - 1) // 2) + 1
        self.usual = np.array(
            [max(1, round(1.0 / (rate_hz * spec.step_s))) for spec in self.specs],
            dtype=np.int64,
        )
        self.steps, self.left, self.frame = (
            self.usual.copy(),
            *zeros((2, n), dtype=np.int64),
        )
        self.t = zeros(n)
        self.h = 1.0 / (rate_hz * self.usual)
        self.damping = np.array(self.scene.damping)[:, None]
        self.joint_k = np.array(self.scene.stiffness)[:, None]
        self.rate = np.array(self.scene.rate)[:, None]
        self.lag = self.damping / self.joint_k * self.rate
        self.start, self.travel_s, self.held, self.give = zeros((4, dof, n))
        self.q, self.q_free, self.q_frame = zeros((3, dof, n))
        self.point, self.normal, self.face, self.along_face = zeros((4, 3, n))
        self.axes, self.origins, self.jacobian = (
            *zeros((2, 3, dof, n)),
            zeros((dof, 2, n)),
        )
        self.y, self.y_frame, self.depth, self.loads = zeros((4, 2, n))
        self.compliance = zeros((3, n))
        self.row_z = (
            skin.row0_z_m - skin.pitch[0] * np.arange(skin.rows, dtype=float)[:, None]
        )
        self.columns = zeros((window, n), dtype=np.intp)
        self.column_gaps, self.reach, self.column_angle = zeros((3, window, n))
        self.gaps, self.stiffness = zeros((2, 0, n))
        self.weight, self.line_gap, self.line_depth, self.row_force = zeros(
            (4, skin.rows, n)
        )
        self.law_gaps, self.slopes, self.intercepts = (
            np.full((1, n), np.inf),
            *zeros((2, 1, n)),
        )
        self.lost = zeros(n, dtype=bool)
        self.soft, self.z, self.taxel_k, self.force, self.deepest, self.inside = zeros(
            (6, n)
        )
        self.image = zeros((skin.rows, window, n))

    def keep(self, effect: str, state: type[Any], **given: Any) -> Any:
        """Keep an effect's state, a dataclass; an array that is not given is (n,)
        zeros."""
        empty = {field.name: np.zeros(self.n) for field in fields(state)}
        self.states[effect] = state(**{**empty, **given})
        return self.states[effect]

    def equilibrium(self, t: Any, i: Index = ALL) -> Array:
        """(dof, n) equilibrium angles of some trials at their times (n,)."""
        way = self.rate * np.minimum(t, pick(self.travel_s, i))
        return np.asarray(pick(self.start, i) + way)

    def add_springs(self, i: Index, gaps: Array, stiffness: Array) -> None:
        """Add springs (S, n of i) to each row of some trials."""
        more = np.full((len(gaps), self.n), np.inf)
        added = np.zeros((len(gaps), self.n))
        more[:, i] = np.where(stiffness > 0.0, gaps, np.inf)
        added[:, i] = stiffness
        self.gaps = np.concatenate([self.gaps, more])
        self.stiffness = np.concatenate([self.stiffness, added])

    def obey(self, i: Index, gaps: Array, stiffness: Array) -> Places:
        """Give some trials the law of springs (E, n of i); returns the springs' order
        by depth."""
        order, gaps, stiffness = by_depth(gaps, stiffness)
        short = len(gaps) - len(self.law_gaps)
        if short > 0:
            self.law_gaps = np.pad(
                self.law_gaps, ((0, short), (0, 0)), constant_values=np.inf
            )
            self.slopes, self.intercepts = (
                np.pad(law, ((0, short), (0, 0)))
                for law in (self.slopes, self.intercepts)
            )
        self.law_gaps[: len(gaps), i] = gaps
        self.slopes[: len(gaps), i], self.intercepts[: len(gaps), i] = bed_law(
            gaps, stiffness
        )
        return order

    def ask(self, i: Index, y: Array, c: Array) -> Array:
        """(2, n of i) the loads of some trials' contacts.

        Args:
            y, c: (n of i) depth without load, and metres that it gives way for each
                newton, instead of the trials' own.
        """
        calls = self.plan.stages["answer"]
        if len(calls) == 1:
            return np.asarray(calls[0].function(self, i, y, c))
        trials = np.arange(self.n) if i is ALL else i
        loads = np.zeros((2, len(trials)))
        for call in calls:
            at = call.which[trials].nonzero()[0]
            if at.size:
                loads[:, at] = call.function(self, trials[at], y[at], c[at])
        return loads
