"""The steps that every trial runs: the soft arm, the contact in closed form, and what is seen."""

from __future__ import annotations

from typing import Any

from numba import njit

from train.simulate.arm import WIDTH, pose_of
from train.simulate.compiled import Array, call, matrix, vector
from train.simulate.contact import add_up, closed_form, share_out, spring_loads
from train.simulate.trial import compiled


@njit(error_model="numpy")
def pose(t: Any) -> None:
    """The arm's pose at its joints."""
    pose_of(matrix(t.chain, t.joints + 1, WIDTH), t.q, t.origin, t.rotation, t.axes, t.origins)


@njit(error_model="numpy")
def crossed(a: Array, b: Array, j: int) -> tuple[float, float, float]:
    """The cross product of a vector and joint j's of (3, dof)."""
    return (
        a[1] * b[2, j] - a[2] * b[1, j],
        a[2] * b[0, j] - a[0] * b[2, j],
        a[0] * b[1, j] - a[1] * b[0, j],
    )


@njit(error_model="numpy")
def ask(t: Any, y0: float, c00: float) -> None:
    """Let the plan's solver answer, in `found`, for the contact as it is but for its depth and what
    gives way to a push."""
    t.free[0], t.free[1] = y0, t.y[1]
    t.c[0], t.c[1], t.c[2] = c00, t.compliance[1], t.compliance[2]
    call(t.solve, t.here)


@compiled
def solve(t: Any) -> None:
    """The force of the bed as it stands, in closed form."""
    t.found[0] = closed_form(
        vector(t.law_gaps, t.law_lines),
        vector(t.slopes, t.law_lines),
        vector(t.intercepts, t.law_lines),
        t.free[0],
        t.c[0],
    )


@compiled
def tune(t: Any) -> None:
    """What holds each joint in a step of this length."""
    for j in range(t.joints):
        t.held[j] = t.damping[j] / t.h
        t.give[j] = 1.0 / (t.held[j] + t.joint_k[j])


@compiled
def locate(t: Any) -> None:
    """Depth, its Jacobian and what the step's loads take off it, at the frame's joint angles."""
    pose(t)
    depth = 0.0
    for i in range(3):
        t.point[i] = t.origin[i] + t.rotation[i, 2] * t.z
        depth += (t.point[i] - t.face[i]) * t.normal[i]
    compliance = 0.0
    for j in range(t.joints):
        x, y, z = crossed(t.normal, t.axes, j)
        lever = (t.point[0] - t.origins[0, j]) * x
        lever += (t.point[1] - t.origins[1, j]) * y
        lever += (t.point[2] - t.origins[2, j]) * z
        t.jacobian[0, j] = lever
        compliance += lever * lever * t.give[j]
        t.q_frame[j] = t.q[j]
    t.y_frame[0] = depth + t.skin_radius_m
    t.compliance[0] = compliance


@njit(error_model="numpy")
def equilibrium(t: Any, j: int, time: float) -> float:
    """Joint j's equilibrium angle."""
    angle: float = t.start[j] + t.rate[j] * min(time, t.travel_s[j])
    return angle


@compiled
def predict(t: Any) -> None:
    """Where the arm would be after the step with no load on it.

    Each joint obeys d q' + k (q - q_eq) = -J^T F; backward Euler in closed form.
    """
    t.t += t.h
    first, second = 0.0, 0.0
    for j in range(t.joints):
        pulled = t.joint_k[j] * equilibrium(t, j, t.t)
        t.q_free[j] = (t.held[j] * t.q[j] + pulled) * t.give[j]
        moved = t.q_free[j] - t.q_frame[j]
        first += t.jacobian[0, j] * moved
        second += t.jacobian[1, j] * moved
    t.y[0], t.y[1] = t.y_frame[0] + first, t.y_frame[1] + second


@njit(error_model="numpy")
def press_at_rest(t: Any) -> None:
    """The contact's loads with the object at rest."""
    ask(t, t.y[0], t.compliance[0])
    t.loads[0], t.loads[1] = t.found[0], t.found[1]


@compiled
def press(t: Any) -> None:
    """The contact's loads: the object is at rest."""
    press_at_rest(t)


@compiled
def settle(t: Any) -> None:
    """The joints give way to the loads."""
    force, moment = t.loads[0], t.loads[1]
    for j in range(t.joints):
        torque = t.jacobian[0, j] * force
        if t.coordinates > 1:
            torque += t.jacobian[1, j] * moment
        t.q[j] = t.q_free[j] - t.give[j] * torque
    c = t.compliance
    if t.coordinates > 1:
        t.depth[0] = t.y[0] - (c[0] * force + c[1] * moment)
        t.depth[1] = t.y[1] - (c[1] * force + c[2] * moment)
    else:
        t.depth[0] = t.y[0] - c[0] * force


@compiled
def tick(t: Any) -> None:
    """The frame ends at its own time: sums of steps would drift from it."""
    t.frame += 1.0
    t.t = t.frame / t.rate_hz


@njit(error_model="numpy")
def deepest(t: Any) -> None:
    """How far the deepest of the lines is pressed."""
    line_depth, weight = vector(t.line_depth, t.lines), vector(t.weight, t.lines)
    deep = line_depth[0] if weight[0] > 0.0 else 0.0
    for line in range(1, t.lines):
        deep = max(deep, line_depth[line] if weight[line] > 0.0 else 0.0)
    t.deepest = deep


@compiled
def bear(t: Any) -> None:
    """The force that the skin bears, and each line's depth."""
    t.force = t.loads[0]
    line_depth, line_gap = vector(t.line_depth, t.lines), vector(t.line_gap, t.lines)
    for line in range(t.lines):
        line_depth[line] = t.depth[0] - line_gap[line]
    deepest(t)


@njit(error_model="numpy")
def lay_law(t: Any, stiffness: int, slopes: int, intercepts: int) -> None:
    """The law of springs that are in order, from their stiffness; all given by their addresses."""
    size = t.law_lines
    add_up(
        vector(t.law_gaps, size),
        vector(stiffness, size),
        vector(slopes, size),
        vector(intercepts, size),
    )


@njit(error_model="numpy")
def bed_loads(t: Any, springs: int, loads: Array) -> None:
    """The load of the first so many of each row's springs, into (rows, springs)."""
    gaps, stiffness = vector(t.gaps, springs), vector(t.stiffness, springs)
    depth, weight = vector(t.line_depth, t.rows), vector(t.weight, t.rows)
    spring_loads(depth, gaps, stiffness, weight, loads)


@compiled
def image(t: Any) -> None:
    """The force shared out among taxels: (rows, columns) newtons."""
    loads = matrix(t.image, t.rows, t.columns)
    bed_loads(t, t.columns, loads)
    share_out(t.force, loads)
