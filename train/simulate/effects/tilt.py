"""The forearm pivots about the contact: a second coordinate, the angle against the face.

Rows then press to different depths, a + lever * tilt, and the loads are a force and a moment.
The energy of arm and bed is convex and piecewise quadratic in (a, tilt), so its minimum is the
one answer; Newton's method finds it in a few rounds, and where it cycles between pieces a line
search on the slope takes over (`guarded`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.errors import EdgeError
from train.simulate import base
from train.simulate.arm import cross, dot
from train.simulate.contact import Array, Coordinates, total
from train.simulate.plan import Build
from train.simulate.state import Bed, State

ROUNDS = 8
"""Plain Newton rounds before the line search takes over; two or three are usual."""
GUARDED_ROUNDS = 5000
"""A bed of 1e11 N/m has taken some hundred: one for each spring that comes or goes."""
CLOSE = (1e-14, 1e-13)
"""Metres and radians: a step below it is rounding."""


@dataclass
class Tilt:
    """The pivoting forearm's own state.

    Attributes:
        guess: loads with which the next step's search begins.
        settled: loads of the step before.
        lever: (L, n) metres along the forearm from the face's middle to each line.
    """

    guess: Coordinates
    settled: Coordinates
    lever: Array


def add(build: Build) -> None:
    """Take the place of the base's geometry, solver and line depths."""
    build.replace(base.locate, pivot)
    build.replace(base.bear, bear)
    build.put("setup", base.ORDER + 2, upright)
    build.put("step", base.SETTLE + 20, remember)
    build.wrap(solve)


def upright(state: State) -> None:
    """No load yet."""
    state.loads = (np.zeros(state.n), np.zeros(state.n))
    state.keep(Tilt(guess=state.loads, settled=state.loads, lever=np.zeros((1, state.n))))


def pivot(state: State) -> None:
    """Depth and tilt against the object's face at the frame's joint angles, with their
    Jacobians; which rows the face covers, and their levers about its middle."""
    skin = state.skin
    pose = state.kinematics.pose(state.q)
    state.pose = pose
    along, normal = pose.rotation[:, 2], state.normal
    row_z = state.row_z
    away = pose.origin - state.face
    z = np.clip(-dot(away, along), float(row_z.min()), float(row_z.max()))
    tilt = dot(normal, along)
    upright = np.sqrt(1.0 - tilt * tilt)
    on_face = dot(away, state.along_face) + row_z * dot(along, state.along_face)
    weight = base.covered(on_face, state)
    rows = np.flatnonzero(weight.any(axis=1))
    lines = slice(rows[0], rows[-1] + 1) if len(rows) else slice(0, 1)
    state.bed.lines = lines
    state.bed.weight = weight[lines]
    state.bed.line_gap = base.curve_gap(on_face[lines], state)
    state.of(Tilt).lever = row_z[lines] - z
    state.point = pose.origin + along * z
    depth = dot(away + along * z, normal) + skin.radius_m * upright
    crossed = cross(normal[:, None], pose.axes)
    turn = dot(along[:, None], crossed)
    push = dot(state.point[:, None] - pose.origins, crossed)
    push = push - (skin.radius_m * tilt / upright) * turn
    give = state.give
    state.q_frame = state.q
    state.jacobian = (push, turn)
    state.y_frame = (depth, tilt)
    state.compliance = (
        dot(push * push, give),
        dot(push * turn, give),
        dot(turn * turn, give),
    )


def line_depths(state: State) -> Array:
    """(L, n) each line's depth."""
    depth, tilt = state.depth
    return np.asarray(depth + state.of(Tilt).lever * tilt - state.bed.line_gap)


def bear(state: State) -> None:
    """The force that the skin bears, and each line's depth."""
    state.force = state.loads[0]
    state.line_depth = line_depths(state)


def remember(state: State) -> None:
    """The next step's loads will go on as these did."""
    own, loads = state.of(Tilt), state.loads
    own.guess = tuple(2.0 * new - old for new, old in zip(loads, own.settled, strict=True))
    own.settled = loads


def answer(bed: Bed, lever: Array, y: Coordinates) -> tuple[Coordinates, Coordinates]:
    """Loads (F, M) at y, and the stiffness there: total, mean lever, spread about the mean."""
    force, stiffness = bed.forces(y[0] + lever * y[1] - bed.line_gap)
    whole = total(stiffness)
    mean = total(stiffness * lever) / np.where(whole > 0.0, whole, 1.0)
    off = lever - mean
    off *= off
    off *= stiffness
    return (total(force), total(force * lever)), (whole, mean, total(off))


def newton_step(c: Coordinates, r: Coordinates, h: Coordinates) -> Coordinates:
    """p of (I + C H) p = r, in coordinates about the stiffness's mean lever, where H is
    diagonal and the determinant a sum of positive terms: no digits are lost at 1e15 N/m."""
    whole, mean, spread = h
    c01 = c[1] + mean * c[2]
    c00 = c[0] + mean * (c[1] + c01)
    r0 = r[0] + mean * r[1]
    det = 1.0 + c00 * whole + c[2] * spread + (c00 * c[2] - c01 * c01) * whole * spread
    p0 = ((1.0 + c[2] * spread) * r0 - c01 * spread * r[1]) / det
    p1 = ((1.0 + c00 * whole) * r[1] - c01 * whole * r0) / det
    return p0 - mean * p1, p1


def residual(y: Coordinates, free: Coordinates, c: Coordinates, f: Coordinates) -> Coordinates:
    """y - (free - C f)."""
    return (
        y[0] - free[0] + (c[0] * f[0] + c[1] * f[1]),
        y[1] - free[1] + (c[1] * f[0] + c[2] * f[1]),
    )


def solve(state: State, free: Coordinates, c: Coordinates) -> Coordinates:
    """The loads (F, M) at which arm and bed agree."""
    own = state.of(Tilt)
    return search(state.bed, own.lever, own.guess, free, c)


def search(
    bed: Bed, lever: Array, guess: Coordinates, free: Coordinates, c: Coordinates
) -> Coordinates:
    """The loads (F, M) with y = free - C (F, M), searched for from a guess of them."""
    force, moment = guess
    y: Coordinates = (
        free[0] - (c[0] * force + c[1] * moment),
        free[1] - (c[1] * force + c[2] * moment),
    )
    done = np.zeros(len(force), dtype=bool)
    loads, h = answer(bed, lever, y)
    for _ in range(ROUNDS):
        p = newton_step(c, residual(y, free, c, loads), h)
        # A trial that is done stays as it is, whatever its neighbours in the batch still need.
        done |= (np.abs(p[0]) <= CLOSE[0]) & (np.abs(p[1]) <= CLOSE[1])
        if done.all():
            break
        y = (np.where(done, y[0], y[0] - p[0]), np.where(done, y[1], y[1] - p[1]))
        loads, h = answer(bed, lever, y)
    else:
        y = guarded(bed, lever, y, free, c, ~done)
        loads, h = answer(bed, lever, y)
    return agree(y, free, c, loads, h[0])


def agree(
    y: Coordinates, free: Coordinates, c: Coordinates, bed: Coordinates, stiffness: Array
) -> Coordinates:
    """The loads at the solution, from the side that has more digits: a stiff bed's depth is
    all rounding, while what the arm has given way is not."""
    det = c[0] * c[2] - c[1] * c[1]
    d0, d1 = free[0] - y[0], free[1] - y[1]
    stiff = (c[0] * stiffness > 1.0) & (det > 0.0) & (bed[0] > 0.0)
    some = np.where(det > 0.0, det, 1.0)
    force = np.where(stiff, (c[2] * d0 - c[1] * d1) / some, bed[0])
    moment = np.where(stiff, (c[0] * d1 - c[1] * d0) / some, bed[1])
    held = force > 0.0
    return np.where(held, force, 0.0), np.where(held, moment, 0.0)


def guarded(
    bed: Bed,
    lever: Array,
    y: Coordinates,
    free: Coordinates,
    c: Coordinates,
    open_: NDArray[np.bool_],
) -> Coordinates:
    """Newton with a line search, for the trials `open_` (n,) that plain Newton left.

    The slope of the energy along a step rises steadily, so a step that ends with the slope
    turned uphill by more than half of what it began with is cut back along its secant.
    """
    where = np.flatnonzero(open_)
    part, levers = bed.take(where), lever[..., where]
    y_, free_ = tuple(v[where] for v in y), tuple(v[where] for v in free)
    c_ = tuple(np.broadcast_to(v, open_.shape)[where] for v in c)
    det = c_[0] * c_[2] - c_[1] * c_[1]

    def slope(at: Coordinates, p: Coordinates) -> Array:
        d0, d1 = at[0] - free_[0], at[1] - free_[1]
        loads, _ = answer(part, levers, at)
        g0 = (c_[2] * d0 - c_[1] * d1) / det + loads[0]
        g1 = (c_[0] * d1 - c_[1] * d0) / det + loads[1]
        return -(p[0] * g0 + p[1] * g1)

    small = np.zeros(len(where), dtype=bool)
    for _ in range(GUARDED_ROUNDS):
        loads, h = answer(part, levers, y_)
        p = newton_step(c_, residual(y_, free_, c_, loads), h)
        small |= (np.abs(p[0]) <= CLOSE[0]) & (np.abs(p[1]) <= CLOSE[1])
        if small.all():
            break
        begin = slope(y_, p)
        size = np.where(small, 0.0, 1.0)
        for _ in range(40):
            end = slope((y_[0] - size * p[0], y_[1] - size * p[1]), p)
            far = (end > 0.5 * np.abs(begin)) & ~small
            if not far.any():
                break
            cut = np.clip(begin / np.where(far, begin - end, 1.0), 0.1, 0.9)
            size = np.where(far, size * cut, size)
        y_ = (y_[0] - size * p[0], y_[1] - size * p[1])
    else:
        raise EdgeError(
            f"the tilt of {int((~small).sum())} contacts was not found in {GUARDED_ROUNDS} rounds; "
            "make the skin, the object or the step less extreme"
        )
    out = (y[0].copy(), y[1].copy())
    out[0][where], out[1][where] = y_
    return out
