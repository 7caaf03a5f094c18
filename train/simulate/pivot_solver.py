"""The loads on a forearm that pivots, compiled: one trial's.

Rows press to different depths, a + lever * tilt, and the loads are a force and a moment. The
energy of arm and bed is convex and piecewise quadratic in (a, tilt), so its minimum is the one
answer; Newton's method finds it in a few rounds, and where it cycles between pieces a line search
on the slope takes over.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from train.simulate.compiled import indices, integers, matrix, vector, vectors
from train.simulate.trial import Part

ROUNDS = 8
"""Plain Newton rounds before the line search takes over; two or three are usual."""
CLOSE_M, CLOSE_RAD = 1e-14, 1e-13
"""A step below both is rounding."""
CUTS = 40
GUARDED_ROUNDS = 5000
"""A bed of 1e11 N/m has taken some hundred: one for each spring that comes or goes."""
NONE_LEFT = 1e-9
"""A determinant of C of so small a part of its terms has too few digits to divide by."""


Answer = tuple[float, float, float, float, float]
"""F and M, and the stiffness there: the whole, its mean lever, its spread about that."""

PIVOT = Part(
    "tilt",
    # The springs by depth: how many, metres at which each is touched, newtons a metre, which of
    # the bed's it is; (rows, springs) of the bed's, 1 where one is not gone, if some can be.
    *integers("springs", "gaps", "stiffness", "column", "alive"),
    ("bursts", "?"),
    # The rows: the part that the face covers, metres by which it draws back there, metres from
    # the contact's middle, what answers to speed, if anything does; each row's stiffness and force.
    *integers("rows", "weight", "line_gap", "lever", "load", "held", "out"),
    ("viscous", "?"),
    "gain",
    # What the arm does within the step, y = free - C (F, M).
    *("free0", "free1", "c00", "c01", "c11"),
    # Loads to begin with, rounds beyond the plain ones; the loads, and whether they were not found.
    *vectors(2, "guess", "settled"),
    *integers("guarded_rounds"),
    *("force", "moment"),
    ("lost", "?"),
)
"""A pivoting forearm's contact: what is asked, and the answer."""
pivot_of = PIVOT.of


@njit(error_model="numpy")
def answer(at: Any, y0: float, y1: float) -> Answer:
    """The loads of the springs at y, and their stiffness; each row's force into `out`."""
    gaps, stiffness = vector(at.gaps, at.springs), vector(at.stiffness, at.springs)
    column, alive = indices(at.column, at.springs), matrix(at.alive, at.rows, at.springs)
    weight, line_gap = vector(at.weight, at.rows), vector(at.line_gap, at.rows)
    lever, load = vector(at.lever, at.rows), vector(at.load, at.rows)
    held, out = vector(at.held, at.rows), vector(at.out, at.rows)
    bursts, viscous, gain = at.bursts, at.viscous, at.gain
    whole_force, moment, whole, first = 0.0, 0.0, 0.0, 0.0
    for row in range(len(weight)):
        if weight[row] == 0.0:
            out[row] = held[row] = 0.0
            continue
        depth = y0 + lever[row] * y1 - line_gap[row]
        force, k_row = 0.0, 0.0
        for c in range(len(gaps)):
            inside = depth - gaps[c]
            if inside <= 0.0:
                break
            k = stiffness[c]
            if bursts:
                k *= alive[row, column[c]]
            force += inside * k
            k_row += k
        force *= weight[row]
        k_row *= weight[row]
        if viscous:
            sum_ = gain * force + load[row]
            bears = force > 0.0 and sum_ > 0.0
            force = sum_ if bears else 0.0
            k_row = gain * k_row if bears else 0.0
        out[row] = force
        held[row] = k_row
        whole_force += force
        moment += force * lever[row]
        whole += k_row
        first += k_row * lever[row]
    mean = first / whole if whole > 0.0 else 0.0
    spread = 0.0
    if whole > 0.0:
        for row in range(len(weight)):
            off = lever[row] - mean
            spread += off * off * held[row]
    return whole_force, moment, whole, mean, spread


@njit(error_model="numpy")
def determinant(at: Any) -> float:
    """Of C; 0 where it is rounding: an arm of one joint pushes and tilts in one, and C has no
    inverse."""
    det: float = at.c00 * at.c11 - at.c01 * at.c01
    return det if det > NONE_LEFT * at.c00 * at.c11 else 0.0


@njit(error_model="numpy")
def newton_step(at: Any, y0: float, y1: float, found: Answer) -> tuple[float, float]:
    """p of (I + C H) p = y - (free - C f), in coordinates about the stiffness's mean lever, where
    H is diagonal and the determinant a sum of positive terms: no digits are lost at 1e15 N/m."""
    force, moment, whole, mean, spread = found
    r0 = y0 - at.free0 + (at.c00 * force + at.c01 * moment)
    r1 = y1 - at.free1 + (at.c01 * force + at.c11 * moment)
    det_c = determinant(at)
    if det_c == 0.0 and at.c00 > 0.0:
        # One way to go, and a stiffness along it.
        lean = at.c01 / at.c00
        reach = 1.0 + lean * mean
        p0 = r0 / (1.0 + at.c00 * (reach * reach * whole + lean * lean * spread))
        return p0, lean * p0
    c01 = at.c01 + mean * at.c11
    c00 = at.c00 + mean * (at.c01 + c01)
    r0 = r0 + mean * r1
    det = 1.0 + c00 * whole + at.c11 * spread + det_c * whole * spread
    p0 = ((1.0 + at.c11 * spread) * r0 - c01 * spread * r1) / det
    p1 = ((1.0 + c00 * whole) * r1 - c01 * whole * r0) / det
    return p0 - mean * p1, p1


@njit(error_model="numpy")
def slope(at: Any, y0: float, y1: float, found: Answer, p0: float, p1: float) -> float:
    """Of the energy at y along -p."""
    det = determinant(at)
    d0, d1 = y0 - at.free0, y1 - at.free1
    if det == 0.0:
        only: float = -(p0 * (d0 / at.c00 + found[0]) + p1 * found[1])
        return only
    g0 = (at.c11 * d0 - at.c01 * d1) / det + found[0]
    g1 = (at.c00 * d1 - at.c01 * d0) / det + found[1]
    along: float = -(p0 * g0 + p1 * g1)
    return along


@njit(error_model="numpy")
def agree(at: Any, y0: float, y1: float, found: Answer) -> tuple[float, float]:
    """The loads at the solution, from the side that has more digits: a stiff bed's depth is
    all rounding, while what the arm has given way is not."""
    force, moment, stiffness = found[0], found[1], found[2]
    if at.c00 * stiffness > 1.0 and force > 0.0:
        det, d0, d1 = determinant(at), at.free0 - y0, at.free1 - y1
        if det > 0.0:
            force = (at.c11 * d0 - at.c01 * d1) / det
            moment = (at.c00 * d1 - at.c01 * d0) / det
        else:
            force = (d0 - at.c01 * moment) / at.c00
    if force > 0.0:
        return force, moment
    return 0.0, 0.0


@njit(error_model="numpy")
def search(at: Any) -> None:
    """The loads (F, M) with y = free - C (F, M), searched for from a guess of them.

    The slope of the energy along a step rises steadily, so a step that ends with the slope
    turned uphill by more than half of what it began with is cut back along its secant.
    """
    y0 = at.free0 - (at.c00 * at.guess[0] + at.c01 * at.guess[1])
    y1 = at.free1 - (at.c01 * at.guess[0] + at.c11 * at.guess[1])
    found = answer(at, y0, y1)
    close = False
    for turn in range(ROUNDS + at.guarded_rounds):
        p0, p1 = newton_step(at, y0, y1, found)
        close = abs(p0) <= CLOSE_M and abs(p1) <= CLOSE_RAD
        if close:
            break
        size = 1.0
        if turn >= ROUNDS:
            begin = slope(at, y0, y1, found, p0, p1)
            for _ in range(CUTS):
                z0, z1 = y0 - size * p0, y1 - size * p1
                end = slope(at, z0, z1, answer(at, z0, z1), p0, p1)
                if not end > 0.5 * abs(begin):
                    break
                size *= min(max(begin / (begin - end), 0.1), 0.9)
        y0 -= size * p0
        y1 -= size * p1
        found = answer(at, y0, y1)
    at.force, at.moment = agree(at, y0, y1, found)
    at.lost = not close
