"""The forearm pivots about the contact, which adds a second coordinate: its angle to
the face.

Rows then press to different depths, a + lever * tilt, and the loads are a force and a
moment (`pivot_solver`).
"""

from dataclasses import dataclass

import numpy as np

from train.simulate.arm import cross, dot
from train.simulate.contact import by_depth, covered, curve_gap
from train.simulate.effects import base
from train.simulate.pivot_solver import Pivots, search
from train.simulate.trials import Array, Index, Places, Trials, pick, total


@dataclass
class Tilt:
    """The contact of a pivoting forearm.

    Attributes:
        lever: (rows, n) metres of each row from the contact's middle.
        guess, settled: (2, n) the loads with which the next search begins, and those of
            the last step.
        gaps: (S, 1, n) metres at which each spring of a row is touched, in ascending
            order.
        stiffness: (S, 1, n) newtons a metre, or (S, rows, n) where springs of some rows
            are gone.
        order: (S, n) the place of each spring in `Trials.gaps`.
        intact: (S, n) newtons a metre of the springs before any is gone.
        nearest: (S,) the smallest gap of any trial's s-th spring.
    """

    lever: Array
    guess: Array
    settled: Array
    gaps: Array
    stiffness: Array
    order: Places
    intact: Array
    nearest: Array

    def keep_alive(self, trials: Places, first: int, alive: Array) -> None:
        """Keep only the springs that are left.

        Args:
            trials: (m,) the trials concerned.
            first: the place in `Trials.gaps` of the first spring that may be gone.
            alive: (S, rows, m) 1 where a spring is left, 0 where it is gone.
        """
        if self.stiffness.shape[1] == 1:
            self.stiffness = np.repeat(self.stiffness, alive.shape[1], axis=1)
        place = np.clip(self.order.take(trials, -1) - first, 0, len(alive) - 1)
        left = np.take_along_axis(alive, place[:, None], axis=0)
        self.stiffness[:, :, trials] = self.intact.take(trials, -1)[:, None] * left


def law(t: Trials, i: Index) -> None:
    """Each row's springs, in the order of their depth."""
    order, gaps, stiffness = by_depth(t.gaps, t.stiffness)
    deep = int(np.isfinite(pick(gaps, i)).sum(axis=0).max())
    order = order[:deep]
    gaps = gaps[:deep]
    stiffness = stiffness[:deep]
    t.keep(
        "tilt",
        Tilt,
        lever=np.zeros((t.rows, t.n)),
        guess=np.zeros((2, t.n)),
        settled=np.zeros((2, t.n)),
        gaps=gaps[:, None],
        stiffness=stiffness[:, None],
        order=order,
        intact=stiffness,
        nearest=pick(gaps, i).min(axis=1),
    )


def locate(t: Trials, i: Index) -> None:
    """Find depth and tilt against the object's face at the frame's joint angles, their
    Jacobians, and the part of each row that the face covers, with its lever about the
    middle."""
    q = pick(t.q, i)
    normal = pick(t.normal, i)
    face = pick(t.face, i)
    along_face = pick(t.along_face, i)
    radius = t.skin.radius_m
    pose = t.kinematics.pose(q)
    along = pose.rotation[2]
    away = pose.origin - face
    tilt = dot(normal, along)
    z = np.clip(-dot(away, along), t.row_z[-1], t.row_z[0])
    on_face = dot(away, along_face) + t.row_z * dot(along, along_face)
    t.weight[:, i] = covered(on_face, pick(t.values["width_m"], i), t.skin.pitch[0])
    t.line_gap[:, i] = curve_gap(on_face, pick(t.values["radius_m"], i))
    t.states["tilt"].lever[:, i] = t.row_z - z
    point = pose.origin + along * z
    upright = np.sqrt(1.0 - tilt * tilt)
    crossed = cross(normal[:, None], pose.axes)
    turn = dot(along[:, None], crossed)
    push = dot(point[:, None] - pose.origins, crossed) - radius * tilt / upright * turn
    jacobian = np.stack([push, turn], axis=1)
    compliance = jacobian * pick(t.give, i)[:, None]
    t.jacobian[:, :, i] = jacobian
    t.compliance[:2, i] = total(push[:, None] * compliance)
    t.compliance[2, i] = total(turn * compliance[:, 1])
    t.y_frame[0, i] = dot(point - face, normal) + radius * upright
    t.y_frame[1, i] = tilt
    base.keep_pose(t, i, q, point, pose)


def answer(t: Trials, i: Index, y: Array, c: Array) -> Array:
    """The loads (F, M) at which arm and bed agree."""
    state = t.states["tilt"]
    viscous = t.states.get("viscous")
    pivots = Pivots(
        i,
        state.gaps,
        state.stiffness,
        state.nearest,
        pick(t.weight, i),
        pick(t.line_gap, i),
        pick(state.lever, i),
        1.0 if viscous is None else pick(viscous.gain, i),
        0.0 if viscous is None else pick(viscous.load, i),
        np.array([y, pick(t.y[1], i)]),
        np.array([c, *pick(t.compliance[1:], i)]),
    )
    loads, t.row_force[:, i], lost = search(pivots, pick(state.guess, i))
    t.lost[i] |= lost
    return loads


def settle(t: Trials, i: Index) -> None:
    """Guess the next loads by extrapolating the last two."""
    state = t.states["tilt"]
    loads = pick(t.loads, i)
    state.guess[:, i] = 2.0 * loads - pick(state.settled, i)
    state.settled[:, i] = loads


def bear(t: Trials, i: Index) -> None:
    """The force on the skin, the push's component along the skin's normal, and each
    row's depth."""
    tilt = pick(t.depth[1], i)
    t.force[i] = pick(t.loads[0], i) * np.sqrt(np.maximum(1.0 - tilt * tilt, 0.0))
    depth = (
        pick(t.depth[0], i)
        + pick(t.states["tilt"].lever, i) * tilt
        - pick(t.line_gap, i)
    )
    base.keep_depth(t, i, depth, pick(t.weight, i))
