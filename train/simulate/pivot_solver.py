"""The loads on forearms that pivot, found for many trials at once.

Rows press to different depths, a + lever * tilt, and the loads are a force and a moment. The
energy of arm and bed is convex and piecewise quadratic in (a, tilt), so its minimum is the one
answer. Newton's method finds it in a few rounds (the Hessian is that of the pieces that are
touched; Qi and Sun, Math. Programming 58, 1993); where it cycles between pieces, a line search on
the slope takes over, in the few trials that need it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from train.simulate.arm import Array
from train.simulate.contact import total

ROUNDS = 8
"""Plain Newton rounds before the line search takes over; two or three are usual."""
CLOSE_M, CLOSE_RAD = 1e-14, 1e-13
"""A step below both is rounding."""
CUTS = 40
GUARDED_ROUNDS = 5000
"""A bed of 1e11 N/m has taken some hundred: one for each spring that comes or goes."""
NO_DIGITS = 1e-9
"""A determinant of C of so small a part of its terms has too few digits to divide by."""


@dataclass(frozen=True)
class Springs:
    """The springs of some of the trials, in the order of their depth.

    Attributes:
        at: (m,) which trials of the contacts.
        gaps: (S, 1, m) metres at which each is touched.
        stiffness: (S, 1, m) newtons a metre, or (S, rows, m) where it differs by row.
        nearest: (S,) the smallest gap of any trial: no spring from here on is touched above it.
    """

    at: NDArray[np.intp]
    gaps: Array
    stiffness: Array
    nearest: Array


class Loads(NamedTuple):
    """What beds bear, (n,) each but for the last.

    Attributes:
        force, moment: newtons and newton metres.
        stiffness: newtons a metre of the whole bed there.
        mean, spread: the mean lever of that stiffness, and its second moment about it.
        rows: (rows, n) newtons.
    """

    force: Array
    moment: Array
    stiffness: Array
    mean: Array
    spread: Array
    rows: Array


def determinant(c: Array) -> Array:
    """Of C (3, n); 0 where it is rounding: an arm of one joint pushes and tilts in one motion, and
    C has no inverse."""
    det = c[0] * c[2] - c[1] * c[1]
    return np.where(det > NO_DIGITS * c[0] * c[2], det, 0.0)


@dataclass(frozen=True)
class Pivots:
    """Contacts of n pivoting forearms: y = free - C (F, M) has to hold.

    Attributes:
        springs: of all trials, in groups of about as many.
        weight, line_gap, lever: (rows, n) the part of each row that the face covers, metres by
            which the face draws back there, metres from the contact's middle.
        gain, load: (n,), (rows, n): a row bears gain F + load of its springs' F (`viscous`).
        free: (2, n) the coordinates without load; c: (3, n) the arm's compliance in them.
        det: (n,) of C, as of `determinant`.
    """

    springs: list[Springs]
    weight: Array
    line_gap: Array
    lever: Array
    gain: Array | float
    load: Array | float
    free: Array
    c: Array
    det: Array

    def loads(self, y: Array) -> Loads:
        """The loads of the springs at coordinates y (2, n)."""
        depth = y[0] + self.lever * y[1] - self.line_gap
        force, held = np.zeros((2, *depth.shape))
        for group in self.springs:
            every = len(group.at) == depth.shape[1]
            pressed = depth if every else depth.take(group.at, -1)
            deep = int(np.searchsorted(group.nearest, pressed.max()))
            if deep == 0:
                continue
            inside = np.maximum(pressed - group.gaps[:deep], 0.0)
            stiffness = group.stiffness[:deep]
            touched = (inside > 0.0) * stiffness
            np.multiply(inside, touched, out=inside)
            if every:
                force, held = total(inside), total(touched)
            else:
                force[:, group.at], held[:, group.at] = total(inside), total(touched)
        force, held = force * self.weight, held * self.weight
        if not isinstance(self.load, float):
            borne = self.gain * force + self.load
            bears = (force > 0.0) & (borne > 0.0)
            force, held = np.where(bears, borne, 0.0), np.where(bears, self.gain * held, 0.0)
        stiffness = total(held)
        mean = total(held * self.lever) / np.where(stiffness > 0.0, stiffness, 1.0)
        off = self.lever - mean
        spread = total(off * off * held)
        return Loads(total(force), total(force * self.lever), stiffness, mean, spread, force)

    def step(self, y: Array, loads: Loads) -> Array:
        """(2, n): p of (I + C H) p = y - (free - C f), in coordinates about the stiffness's mean
        lever, where H is diagonal and the determinant a sum of positive terms: no digits are lost
        at 1e15 N/m."""
        c00, c01, c11 = self.c
        force, moment, k, mean, spread, _ = loads
        r0 = y[0] - self.free[0] + (c00 * force + c01 * moment)
        r1 = y[1] - self.free[1] + (c01 * force + c11 * moment)
        det_c = self.det
        b01 = c01 + mean * c11
        b00 = c00 + mean * (c01 + b01)
        r = r0 + mean * r1
        first, second = 1.0 + c11 * spread, 1.0 + b00 * k
        det = 1.0 + b00 * k + c11 * spread + det_c * k * spread
        p0 = (first * r - b01 * spread * r1) / det
        p1 = (second * r1 - b01 * k * r) / det
        p = np.array([p0 - mean * p1, p1])
        single = (det_c == 0.0) & (c00 > 0.0)
        if single.any():
            # One way to go, and a stiffness along it.
            lean = c01 / np.where(single, c00, 1.0)
            reach = 1.0 + lean * mean
            p0 = r0 / (1.0 + c00 * (reach * reach * k + lean * lean * spread))
            p = np.where(single, np.array([p0, lean * p0]), p)
        return p

    def arm(self, y: Array) -> tuple[Array, NDArray[np.bool_]]:
        """The loads that the arm gives at y, and (n,) whether C tells both of them."""
        c00, c01, c11 = self.c
        det = self.det
        tells, d = det > 0.0, self.free - y
        over = np.where(tells, det, 1.0)
        both = np.array([c11 * d[0] - c01 * d[1], c00 * d[1] - c01 * d[0]]) / over
        return both, tells

    def slope(self, y: Array, loads: Loads, p: Array) -> Array:
        """Of the energy at y along -p."""
        given, tells = self.arm(y)
        single = p[0] * ((y[0] - self.free[0]) / self.c[0] + loads.force) + p[1] * loads.moment
        both = p[0] * (loads.force - given[0]) + p[1] * (loads.moment - given[1])
        return np.asarray(np.where(tells, -both, -single))

    def agreed(self, y: Array, loads: Loads) -> Array:
        """(2, n) the loads at the solution, from the side that has more digits: a stiff bed's depth
        is all rounding, while what the arm has given way is not."""
        c00, c01, _ = self.c
        given, tells = self.arm(y)
        single = (self.free[0] - y[0] - c01 * loads.moment) / np.where(c00 > 0.0, c00, 1.0)
        stiff = (c00 * loads.stiffness > 1.0) & (loads.force > 0.0)
        force = np.where(stiff, np.where(tells, given[0], single), loads.force)
        moment = np.where(stiff & tells, given[1], loads.moment)
        return np.where(force > 0.0, np.array([force, moment]), 0.0)


class Answer(NamedTuple):
    """Loads (2, n), what each row bears (rows, n), and (n,) whether they were not found."""

    loads: Array
    rows: Array
    lost: NDArray[np.bool_]


def search(pivots: Pivots, guess: Array, guarded_rounds: int = GUARDED_ROUNDS) -> Answer:
    """The loads (F, M) with y = free - C (F, M), searched for from a guess (2, n) of them.

    The slope of the energy rises steadily along a step. Where it ends uphill by more than half of
    its value at the start, the step is cut back along its secant.
    """
    c = pivots.c
    y = pivots.free - np.array(
        [c[0] * guess[0] + c[1] * guess[1], c[1] * guess[0] + c[2] * guess[1]]
    )
    loads = pivots.loads(y)
    for turn in range(ROUNDS + guarded_rounds):
        p = pivots.step(y, loads)
        searching = (np.abs(p[0]) > CLOSE_M) | (np.abs(p[1]) > CLOSE_RAD)
        if not searching.any():
            break
        p = np.where(searching, p, 0.0)
        if turn >= ROUNDS:
            p = p * _cut(pivots, y, loads, p)
        y = y - p
        loads = pivots.loads(y)
    return Answer(pivots.agreed(y, loads), loads.rows, searching)


def _cut(contacts: Pivots, at: Array, loads: Loads, p: Array) -> Array:
    """(n,) the part of a step p that does not go too far."""
    begin, size = contacts.slope(at, loads, p), np.ones(at.shape[1])
    far = np.ones(at.shape[1], dtype=bool)
    for _ in range(CUTS):
        z = at - size * p
        end = contacts.slope(z, contacts.loads(z), p)
        far &= end > 0.5 * np.abs(begin)
        if not far.any():
            break
        fall = np.where(far, begin - end, 1.0)
        size = np.where(far, size * np.clip(begin / fall, 0.1, 0.9), size)
    return size
