"""Finds the loads on pivoting forearms, for many trials at once.

Rows press to different depths, a + lever * tilt, and the loads are a force and a
moment. The energy of arm and bed is convex and piecewise quadratic in (a, tilt), so it
has one minimum, which is the answer. Newton's method finds it in a few rounds, with the
Hessian of the springs touched (Qi and Sun, Math. Programming 58, 1993). In the few
trials where it cycles, a line search on the slope takes over.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from train.simulate.arm import Array, Mask
from train.simulate.contact import total

ROUNDS = 8
"""Plain Newton rounds before the line search takes over; most searches need two or
three."""
CLOSE_M = 1e-14
CLOSE_RAD = 1e-13
"""A step below both is rounding error."""
CUTS = 40
GUARDED_ROUNDS = 5000
"""A bed of 1e11 N/m takes some hundred rounds, one for each spring that comes or
goes."""
NO_DIGITS = 1e-9
"""A determinant of C smaller than this part of its terms has too few digits to divide
by."""


class Loads(NamedTuple):
    """The loads of beds, (n,) each except the last.

    Attributes:
        force, moment: newtons and newton metres.
        stiffness: newtons a metre of the whole bed at this depth.
        mean, spread: the mean lever of that stiffness, and its second moment about it.
        rows: (rows, n) newtons.
    """

    force: Array
    moment: Array
    stiffness: Array
    mean: Array
    spread: Array
    rows: Array


@dataclass(frozen=True)
class Pivots:
    """Contacts of n pivoting forearms, whose loads must satisfy y = free - C (F, M).

    Attributes:
        gaps, springs: (S, n) metres at which each row's springs are touched, and their
            (1, S, n) newtons a metre, or (rows, S, n) where these differ by row.
        weight, line_gap, lever: (rows, n) the part of each row that the face covers,
            metres by which the face draws back there, metres from the contact's middle.
        gain, load: (n,), (rows, n): a row whose springs bear F bears gain F + load.
        free: (2, n) the coordinates without load; c: (3, n) the arm's compliance in
            them.
    """

    gaps: Array
    springs: Array
    weight: Array
    line_gap: Array
    lever: Array
    gain: Array
    load: Array
    free: Array
    c: Array

    @cached_property
    def det(self) -> Array:
        """(n,) the determinant of C, and 0 where it is only rounding error: an arm of
        one joint pushes and tilts in one motion, so its C has no inverse."""
        det = self.c[0] * self.c[2] - self.c[1] * self.c[1]
        return np.where(det > NO_DIGITS * self.c[0] * self.c[2], det, 0.0)

    def loads(self, y: Array) -> Loads:
        """The loads of the springs at coordinates y (2, n)."""
        depth = y[0] + self.lever * y[1] - self.line_gap
        pressed, touched = self._bed(depth)
        elastic = pressed * self.weight
        borne = self.gain * elastic + self.load
        bears = (elastic > 0.0) & (borne > 0.0)
        force = np.where(bears, borne, 0.0)
        row_stiffness = np.where(bears, self.gain * (touched * self.weight), 0.0)
        stiffness = total(row_stiffness)
        mean = total(row_stiffness * self.lever) / np.where(
            stiffness > 0.0, stiffness, 1.0
        )
        off = self.lever - mean
        spread = total(off * off * row_stiffness)
        return Loads(
            total(force),
            total(force * self.lever),
            stiffness,
            mean,
            spread,
            force,
        )

    def _bed(self, depth: Array) -> tuple[Array, Array]:
        """The force and the stiffness (rows, n) of the springs touched at depths
        (rows, n) of the rows.

        A deep touch reaches fifty springs and most touches three, so this goes through
        the pairs of a trial and a spring that one of its rows touches. `bincount` adds
        them one after the other, as `total` does.
        """
        rows, n = depth.shape
        pairs = np.flatnonzero(self.gaps < depth.max(axis=0))
        trials = pairs % n
        inside = depth.take(trials, 1) - self.gaps.take(pairs)
        springs = self.springs.reshape(len(self.springs), -1).take(pairs, 1)
        touched = (inside > 0.0) * springs
        to = (np.arange(0, rows * n, n)[:, None] + trials).ravel()
        pressed = np.bincount(to, (inside * touched).ravel(), rows * n)
        stiffness = np.bincount(to, touched.ravel(), rows * n)
        return (
            np.asarray(pressed, dtype=float).reshape(rows, n),
            np.asarray(stiffness, dtype=float).reshape(rows, n),
        )

    def step(self, y: Array, loads: Loads) -> Array:
        """(2, n) the Newton step p of (I + C H) p = y - (free - C f).

        In coordinates about the mean lever of the stiffness, H is diagonal and the
        determinant is a sum of positive terms, so no digits are lost at 1e15 N/m.
        """
        c00, c01, c11 = self.c
        force, moment, k, mean, spread, _ = loads
        r0 = y[0] - self.free[0] + (c00 * force + c01 * moment)
        r1 = y[1] - self.free[1] + (c01 * force + c11 * moment)
        b01 = c01 + mean * c11
        b00 = c00 + mean * (c01 + b01)
        r = r0 + mean * r1
        first = 1.0 + c11 * spread
        second = 1.0 + b00 * k
        det = 1.0 + b00 * k + c11 * spread + self.det * k * spread
        p0 = (first * r - b01 * spread * r1) / det
        p1 = (second * r1 - b01 * k * r) / det
        p = np.array([p0 - mean * p1, p1])
        single = (self.det == 0.0) & (c00 > 0.0)
        if single.any():
            # Such an arm moves along one line, with one stiffness along it.
            lean = c01 / np.where(single, c00, 1.0)
            reach = 1.0 + lean * mean
            p0 = r0 / (1.0 + c00 * (reach * reach * k + lean * lean * spread))
            p = np.where(single, np.array([p0, lean * p0]), p)
        return p

    def arm(self, y: Array) -> tuple[Array, Mask]:
        """The loads of the arm at y, and (n,) whether C has an inverse that gives both
        of them."""
        c00, c01, c11 = self.c
        invertible = self.det > 0.0
        d = self.free - y
        divisor = np.where(invertible, self.det, 1.0)
        loads = np.array([c11 * d[0] - c01 * d[1], c00 * d[1] - c01 * d[0]]) / divisor
        return loads, invertible

    def slope(self, y: Array, loads: Loads, p: Array) -> Array:
        """(n,) the slope of the energy at y along -p."""
        inverse, invertible = self.arm(y)
        single = (
            p[0] * ((y[0] - self.free[0]) / self.c[0] + loads.force)
            + p[1] * loads.moment
        )
        double = p[0] * (loads.force - inverse[0]) + p[1] * (loads.moment - inverse[1])
        return np.asarray(np.where(invertible, -double, -single))

    def agreed(self, y: Array, loads: Loads) -> Array:
        """(2, n) the loads at the solution, from the side with more digits.

        The depth of a stiff bed is mostly rounding error; the way of the arm is not.
        """
        c00, c01, _ = self.c
        inverse, invertible = self.arm(y)
        single = (self.free[0] - y[0] - c01 * loads.moment) / np.where(
            c00 > 0.0,
            c00,
            1.0,
        )
        stiff = (c00 * loads.stiffness > 1.0) & (loads.force > 0.0)
        force = np.where(stiff, np.where(invertible, inverse[0], single), loads.force)
        moment = np.where(stiff & invertible, inverse[1], loads.moment)
        return np.where(force > 0.0, np.array([force, moment]), 0.0)


def search(pivots: Pivots, guess: Array) -> tuple[Array, Array, Mask]:
    """The loads (F, M) with y = free - C (F, M), searched for from a guess (2, n) of
    them; the force on each row (rows, n), and (n,) whether the search failed.

    The slope of the energy rises steadily along a step. Where it ends uphill by more
    than half of its value at the start, the step is cut back along its secant.
    """
    c = pivots.c
    y = pivots.free - np.array(
        [c[0] * guess[0] + c[1] * guess[1], c[1] * guess[0] + c[2] * guess[1]]
    )
    loads = pivots.loads(y)
    for turn in range(ROUNDS + GUARDED_ROUNDS):
        p = pivots.step(y, loads)
        searching = (np.abs(p[0]) > CLOSE_M) | (np.abs(p[1]) > CLOSE_RAD)
        if not searching.any():
            break
        p = np.where(searching, p, 0.0)
        if turn >= ROUNDS:
            p = p * _cut(pivots, y, loads, p)
        y = y - p
        loads = pivots.loads(y)
    return pivots.agreed(y, loads), loads.rows, searching


def _cut(contacts: Pivots, at: Array, loads: Loads, p: Array) -> Array:
    """(n,) the part of a step p to take, so that it does not go too far."""
    begin = contacts.slope(at, loads, p)
    size = np.ones(at.shape[1])
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
