"""The loads on a forearm that pivots, trial by trial, compiled.

Rows press to different depths, a + lever * tilt, and the loads are a force and a moment. The
energy of arm and bed is convex and piecewise quadratic in (a, tilt), so its minimum is the one
answer; Newton's method finds it in a few rounds, and where it cycles between pieces a line search
on the slope takes over. A trial's arithmetic does not know of its neighbours in the batch.

numba compiles what is called when it is first called, and keeps the result beside this file: of the
functions that others call alone, as a kept one cannot be found again once a class that it takes
has another name.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import cfunc, njit, types
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from train.simulate.contact import Array, Coordinates, Springs
from train.simulate.replay import at, floats

ROUNDS = 8
"""Plain Newton rounds before the line search takes over; two or three are usual."""
CLOSE_M, CLOSE_RAD = 1e-14, 1e-13
"""A step below both is rounding."""
CUTS = 40
GUARDED_ROUNDS = 5000
"""A bed of 1e11 N/m has taken some hundred: one for each spring that comes or goes."""


Answer = tuple[float, float, float, float, float]
"""F and M, and the stiffness there: the whole, its mean lever, its spread about that."""


class PivotContact(NamedTuple):
    """One trial's springs: gaps, stiffness and number of each spring by depth; weight, gap, lever
    and viscous load of each row; and what the arm does within the step, y = free - C (F, M)."""

    gaps: Array
    stiffness: Array
    column: NDArray[np.int64]
    weight: Array
    line_gap: Array
    lever: Array
    load: Array
    held: Array
    gain: float
    viscous: bool
    free0: float
    free1: float
    c00: float
    c01: float
    c11: float


@njit(error_model="numpy")
def contact_of(
    springs: Springs, i: int, rows: tuple[Array, ...], free: Coordinates, c: Coordinates
) -> PivotContact:
    """Trial i's, its rows gathered into scratch arrays."""
    weight, line_gap, lever, load, held = rows
    viscous = springs.load.shape[0] > 0
    for row in range(len(weight)):
        weight[row] = springs.weight[row, i]
        line_gap[row] = springs.line_gap[row, i]
        lever[row] = springs.lever[row, i]
        if viscous:
            load[row] = springs.load[row, i]
    gain = springs.gain[i] if viscous else 1.0
    return PivotContact(
        springs.gaps[i],
        springs.stiffness[i],
        springs.column[i],
        weight,
        line_gap,
        lever,
        load,
        held,
        gain,
        viscous,
        free[0][i],
        free[1][i],
        c[0][i],
        c[1][i],
        c[2][i],
    )


@njit(error_model="numpy")
def answer(contact: PivotContact, alive: Array, i: int, y0: float, y1: float, out: Array) -> Answer:
    """The loads of trial i's springs at y, and their stiffness; each row's force into `out`."""
    gaps, stiffness, column = contact.gaps, contact.stiffness, contact.column
    weight, line_gap, lever = contact.weight, contact.line_gap, contact.lever
    load, held = contact.load, contact.held
    some_burst = alive.shape[0] > 0
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
            if some_burst:
                k *= alive[row, column[c], i]
            force += inside * k
            k_row += k
        force *= weight[row]
        k_row *= weight[row]
        if contact.viscous:
            sum_ = contact.gain * force + load[row]
            bears = force > 0.0 and sum_ > 0.0
            force = sum_ if bears else 0.0
            k_row = contact.gain * k_row if bears else 0.0
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
def newton_step(at: PivotContact, y0: float, y1: float, found: Answer) -> tuple[float, float]:
    """p of (I + C H) p = y - (free - C f), in coordinates about the stiffness's mean lever, where
    H is diagonal and the determinant a sum of positive terms: no digits are lost at 1e15 N/m."""
    force, moment, whole, mean, spread = found
    r0 = y0 - at.free0 + (at.c00 * force + at.c01 * moment)
    r1 = y1 - at.free1 + (at.c01 * force + at.c11 * moment)
    c01 = at.c01 + mean * at.c11
    c00 = at.c00 + mean * (at.c01 + c01)
    r0 = r0 + mean * r1
    det = 1.0 + c00 * whole + at.c11 * spread + (c00 * at.c11 - c01 * c01) * whole * spread
    p0 = ((1.0 + at.c11 * spread) * r0 - c01 * spread * r1) / det
    p1 = ((1.0 + c00 * whole) * r1 - c01 * whole * r0) / det
    return p0 - mean * p1, p1


@njit(error_model="numpy")
def slope(at: PivotContact, y0: float, y1: float, found: Answer, p0: float, p1: float) -> float:
    """Of the energy at y along -p."""
    det = at.c00 * at.c11 - at.c01 * at.c01
    d0, d1 = y0 - at.free0, y1 - at.free1
    g0 = (at.c11 * d0 - at.c01 * d1) / det + found[0]
    g1 = (at.c00 * d1 - at.c01 * d0) / det + found[1]
    return -(p0 * g0 + p1 * g1)


@njit(error_model="numpy")
def agree(at: PivotContact, y0: float, y1: float, found: Answer) -> tuple[float, float]:
    """The loads at the solution, from the side that has more digits: a stiff bed's depth is
    all rounding, while what the arm has given way is not."""
    force, moment, stiffness = found[0], found[1], found[2]
    det = at.c00 * at.c11 - at.c01 * at.c01
    if at.c00 * stiffness > 1.0 and det > 0.0 and force > 0.0:
        d0, d1 = at.free0 - y0, at.free1 - y1
        force = (at.c11 * d0 - at.c01 * d1) / det
        moment = (at.c00 * d1 - at.c01 * d0) / det
    if force > 0.0:
        return force, moment
    return 0.0, 0.0


@njit(cache=True, error_model="numpy")
def search(
    springs: Springs,
    guess: Coordinates,
    free: Coordinates,
    c: Coordinates,
    guarded_rounds: int,
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """The loads (F, M), (n,) each, with y = free - C (F, M), searched for from a guess of them.

    The slope of the energy along a step rises steadily, so a step that ends with the slope
    turned uphill by more than half of what it began with is cut back along its secant.

    Returns:
        F, M, and which trials were not found within 8 plain and `guarded_rounds` guarded rounds.
    """
    n = len(free[0])
    forces, moments, lost = np.zeros(n), np.zeros(n), np.zeros(n, dtype=np.bool_)
    size_ = springs.weight.shape[0]
    rows = (np.zeros(size_), np.zeros(size_), np.zeros(size_), np.zeros(size_), np.zeros(size_))
    out, alive = np.zeros(size_), springs.alive
    for i in range(n):
        at = contact_of(springs, i, rows, free, c)
        y0 = at.free0 - (at.c00 * guess[0][i] + at.c01 * guess[1][i])
        y1 = at.free1 - (at.c01 * guess[0][i] + at.c11 * guess[1][i])
        found = answer(at, alive, i, y0, y1, out)
        close = False
        for turn in range(ROUNDS + guarded_rounds):
            p0, p1 = newton_step(at, y0, y1, found)
            close = abs(p0) <= CLOSE_M and abs(p1) <= CLOSE_RAD
            if close:
                break
            size = 1.0
            if turn >= ROUNDS:
                begin = slope(at, y0, y1, found, p0, p1)
                for _ in range(CUTS):
                    z0, z1 = y0 - size * p0, y1 - size * p1
                    end = slope(at, z0, z1, answer(at, alive, i, z0, z1, out), p0, p1)
                    if not end > 0.5 * abs(begin):
                        break
                    size *= min(max(begin / (begin - end), 0.1), 0.9)
            y0 -= size * p0
            y1 -= size * p1
            found = answer(at, alive, i, y0, y1, out)
        lost[i] = not close
        forces[i], moments[i] = agree(at, y0, y1, found)
    return forces, moments, lost


@njit(cache=True, error_model="numpy")
def line_forces(springs: Springs, y: Coordinates) -> Array:
    """(rows, n) force of each row at the contacts' depths and tilts (n,)."""
    size, n = springs.weight.shape
    forces = np.zeros((size, n))
    rows = (np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size), np.zeros(size))
    out, none = np.zeros(size), (y[0], y[1], y[0])
    for i in range(n):
        at = contact_of(springs, i, rows, y, none)
        answer(at, springs.alive, i, y[0][i], y[1][i], out)
        for row in range(size):
            forces[row, i] = out[row]
    return forces


# The same two, called from a tape: with a table of addresses and lengths, four numbers an array.


@njit(error_model="numpy")
def _vector(table: Any, i: int) -> Array:
    return carray(floats(table[4 * i]), (table[4 * i + 1],))


@njit(error_model="numpy")
def _matrix(table: Any, i: int) -> Array:
    return carray(floats(table[4 * i]), (table[4 * i + 1], table[4 * i + 2]))


@njit(error_model="numpy")
def _springs(table: Any) -> Springs:
    columns = carray(at(table[8], types.int64), (table[9], table[10]))
    shape = (table[25], table[26], table[27])
    alive = carray(floats(table[24]), shape)
    return Springs(
        _matrix(table, 0),
        _matrix(table, 1),
        columns,
        _matrix(table, 3),
        _matrix(table, 4),
        _matrix(table, 5),
        alive,
        _vector(table, 7),
        _matrix(table, 8),
    )


@cfunc("void(CPointer(int64))", cache=True, error_model="numpy")
def taped_search(table: Any) -> None:
    """`search`, with the springs, the guess, y and C of the table; its results after them."""
    v = 9
    guess = (_vector(table, v), _vector(table, v + 1))
    free = (_vector(table, v + 2), _vector(table, v + 3))
    c = (_vector(table, v + 4), _vector(table, v + 5), _vector(table, v + 6))
    forces, moments, lost = search(_springs(table), guess, free, c, GUARDED_ROUNDS)
    _vector(table, v + 7)[:] = forces
    _vector(table, v + 8)[:] = moments
    out = _vector(table, v + 9)
    for i in range(len(lost)):
        out[i] = 1.0 if lost[i] else 0.0


@cfunc("void(CPointer(int64))", cache=True, error_model="numpy")
def taped_line_forces(table: Any) -> None:
    """`line_forces`, with the springs and the depths of the table; its result after them."""
    forces = line_forces(_springs(table), (_vector(table, 9), _vector(table, 10)))
    _matrix(table, 11)[:] = forces
