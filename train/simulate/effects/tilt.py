"""The forearm pivots about the contact: a second coordinate, the angle against the face.

Rows then press to different depths, a + lever * tilt, and the loads are a force and a moment
(`pivot_solver`).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from train.simulate import base
from train.simulate.arm import Array, cross, dot
from train.simulate.contact import by_depth, covered, curve_gap, total
from train.simulate.pivot_solver import GUARDED_ROUNDS, Pivots, Springs, determinant, search
from train.simulate.plan import Index
from train.simulate.trials import Trials, pick

ALIKE = 16
"""Trials whose rows have as many springs, up to a multiple of this, are solved as one array."""


@dataclass
class Group:
    """Trials whose rows have about as many springs.

    Attributes:
        trials: (m,) which they are.
        springs: in the order of their depth.
        order: (S, m) which of `Trials.gaps` each is.
        intact: (S, m) newtons a metre, as long as none is gone.
    """

    trials: NDArray[np.intp]
    springs: Springs
    order: NDArray[np.intp]
    intact: Array


@dataclass
class Tilt:
    """A pivoting forearm's contact.

    Attributes:
        lever: (rows, n) metres of each row from the contact's middle.
        guess, settled: (2, n) the loads that the next search begins with, and the last step's.
        groups: the beds' springs.
    """

    lever: Array
    guess: Array
    settled: Array
    groups: list[Group] = field(default_factory=list)

    def keep_alive(self, trials: NDArray[np.intp], first: int, alive: Array) -> None:
        """Leave some trials those springs alone that are still there.

        Args:
            trials: (m,) which, in ascending order.
            first: the place in `Trials.gaps` of the springs that may be gone.
            alive: (S, rows, m) 1 where one is left, 0 where it is gone.
        """
        for group in self.groups:
            mine = np.isin(trials, group.trials).nonzero()[0]
            if not mine.size:
                continue
            at, old = np.searchsorted(group.trials, trials[mine]), group.springs
            same = old.stiffness.shape[1] == 1
            stiffness = np.repeat(old.stiffness, alive.shape[1] if same else 1, axis=1)
            which = group.order.take(at, -1)[:, None] - first
            left = np.take_along_axis(alive.take(mine, -1), which, axis=0)
            stiffness[:, :, at] = group.intact.take(at, -1)[:, None] * left
            group.springs = Springs(old.at, old.gaps, stiffness, old.nearest)


def law(t: Trials, i: Index) -> None:
    """Each row's springs, in the order of their depth."""
    own = t.own["tilt"] = Tilt(np.zeros((t.rows, t.n)), *np.zeros((2, 2, t.n)))
    trials = np.arange(t.n)[i]
    order, gaps, stiffness = by_depth(pick(t.gaps, i), pick(t.stiffness, i))
    counts = np.isfinite(gaps).sum(axis=0)
    sizes = -(-counts // ALIKE)
    for size in np.unique(sizes):
        at = (sizes == size).nonzero()[0]
        deep = int(counts[at].max())
        some, k = gaps[:deep].take(at, -1), stiffness[:deep].take(at, -1)
        springs = Springs(trials[at], some[:, None], k[:, None], some.min(axis=1))
        own.groups.append(Group(trials[at], springs, order[:deep].take(at, -1), k))


def locate(t: Trials, i: Index) -> None:
    """Depth and tilt against the object's face at the frame's joint angles, with their Jacobians;
    which rows the face covers, and their levers about its middle."""
    q, normal, face = pick(t.q, i), pick(t.normal, i), pick(t.face, i)
    along_face, radius = pick(t.along_face, i), t.skin.radius_m
    pose = t.kinematics.pose(q)
    along, away = pose.rotation[2], pose.origin - face
    tilt = dot(normal, along)
    z = np.clip(-dot(away, along), t.row_z[-1], t.row_z[0])
    on_face = dot(away, along_face) + t.row_z * dot(along, along_face)
    t.weight[:, i] = covered(on_face, pick(t.values["width_m"], i), t.skin.row_pitch_m)
    t.line_gap[:, i] = curve_gap(on_face, pick(t.values["radius_m"], i))
    t.own["tilt"].lever[:, i] = t.row_z - z
    point, upright = pose.origin + along * z, np.sqrt(1.0 - tilt * tilt)
    crossed = cross(normal[:, None], pose.axes)
    turn = dot(along[:, None], crossed)
    push = dot(point[:, None] - pose.origins, crossed) - radius * tilt / upright * turn
    jacobian = np.stack([push, turn], axis=1)
    given = jacobian * pick(t.give, i)[:, None]
    t.jacobian[:, :, i] = jacobian
    t.compliance[:2, i] = total(push[:, None] * given)
    t.compliance[2, i] = total(turn * given[:, 1])
    t.y_frame[0, i] = dot(point - face, normal) + radius * upright
    t.y_frame[1, i] = tilt
    base.keep_pose(t, i, q, point, pose.axes, pose.origins)


def answer(t: Trials, i: Index, y: Array, c: Array) -> Array:
    """The loads (F, M) at which arm and bed agree."""
    own, viscous = t.own["tilt"], t.own.get("viscous")
    trials = np.arange(t.n)[i]
    place = np.full(t.n, -1)
    place[trials] = np.arange(len(trials))
    springs = []
    for group in own.groups:
        at = place[group.trials]
        mine = (at >= 0).nonzero()[0]
        if mine.size == len(at):
            found = group.springs
            springs.append(Springs(at, found.gaps, found.stiffness, found.nearest))
        elif mine.size:
            parts = (group.springs.gaps.take(mine, -1), group.springs.stiffness.take(mine, -1))
            springs.append(Springs(at[mine], *parts, group.springs.nearest))
    c = np.array([c, pick(t.compliance[1], i), pick(t.compliance[2], i)])
    pivots = Pivots(
        springs,
        pick(t.weight, i),
        pick(t.line_gap, i),
        pick(own.lever, i),
        1.0 if viscous is None else pick(viscous.gain, i),
        0.0 if viscous is None else pick(viscous.load, i),
        np.array([y, pick(t.y[1], i)]),
        c,
        determinant(c),
    )
    found = search(pivots, pick(own.guess, i), GUARDED_ROUNDS)
    t.row_force[:, i] = found.rows
    t.lost[i] |= found.lost
    return found.loads


def settle(t: Trials, i: Index) -> None:
    """The next step's loads will go on as these did."""
    own, loads = t.own["tilt"], pick(t.loads, i)
    own.guess[:, i] = 2.0 * loads - pick(own.settled, i)
    own.settled[:, i] = loads


def bear(t: Trials, i: Index) -> None:
    """The force that the skin bears, which is the push's part along its own normal, and each row's
    depth."""
    tilt = pick(t.depth[1], i)
    t.force[i] = pick(t.loads[0], i) * np.sqrt(np.maximum(1.0 - tilt * tilt, 0.0))
    depth = pick(t.depth[0], i) + pick(t.own["tilt"].lever, i) * tilt - pick(t.line_gap, i)
    base.keep_depth(t, i, depth, pick(t.weight, i))
