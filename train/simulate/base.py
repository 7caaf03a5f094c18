"""What every trial runs: the soft arm that follows its equilibrium point, the bed of taxels,
and the image of the load. Effects add to it, or take the place of one of its functions."""

from __future__ import annotations

import math

import numpy as np

from edge.errors import InputError
from edge.touch.arm import Chain
from train.simulate.arm import cross, dot
from train.simulate.contact import (
    Array,
    Coordinates,
    closed_form,
    relieve,
    share_out,
    sort_bed,
    spring_loads,
    total,
)
from train.simulate.plan import Build
from train.simulate.state import Bed, State

# Ranks within the stages; effects put themselves between.
SWING, PLACE, SPRINGS, WINDOW, BED, ORDER = 0, 5, 10, 30, 40, 60
LOCATE, LAYOUT = 10, 20
PREDICT, PRESS, SETTLE = 10, 30, 60
TICK, BEAR, IMAGE = 0, 10, 30


def add(build: Build) -> None:
    """Put the base's functions into the plan."""
    build.wrap(solve)
    build.put("setup", SWING, swing)
    build.put("setup", PLACE, place)
    build.put("setup", SPRINGS, springs)
    build.put("setup", WINDOW, window)
    build.put("setup", BED, lay_bed)
    build.put("setup", ORDER, order_bed)
    build.put("frame", LOCATE, locate)
    build.put("step", PREDICT, predict)
    build.put("step", PRESS, press)
    build.put("step", SETTLE, settle)
    build.put("sample", TICK, tick)
    build.put("sample", BEAR, bear)
    build.put("sample", IMAGE, image)
    build.trace("depth_m", deepest)


def solve(state: State, y: Coordinates, c: Coordinates) -> Coordinates:
    """The force of the bed as it stands, in closed form."""
    return closed_form(state.bed.slopes, state.bed.intercepts, y, c)


def equilibrium(state: State, t: float | Array) -> Array:
    """(dof, n) equilibrium angles at time t."""
    return np.asarray(state.start + state.rate * np.minimum(t, state.travel_s))


def limits(chain: Chain) -> tuple[Array, Array]:
    """(dof, 1) radians, the lower and upper limit of each joint; without limits infinite."""
    none = (-math.inf, math.inf)
    both = [pair if pair is not None else none for pair in chain.limits]
    return np.array([b[0] for b in both])[:, None], np.array([b[1] for b in both])[:, None]


def swing(state: State) -> None:
    """Set the arm in its steady sweep.

    Before the contact each joint lags its equilibrium point by d/k of its speed: the steady
    answer of d q' + k (q - q_eq) = 0 to a ramp.
    """
    scene = state.scene
    k = np.array(scene.stiffness)[:, None]
    d = np.array(scene.damping)[:, None]
    low, high = limits(scene.arm)
    start = np.repeat(np.array(scene.start)[:, None], state.n, axis=1)
    start[-1] += np.radians(state.values["roll_deg"])
    state.start = np.clip(start, low, high)
    state.rate = np.array(scene.rate)[:, None]
    # Each joint's equilibrium point stops at the joint's limit.
    way = np.abs(np.where(state.rate > 0.0, high, low) - state.start)
    moves = state.rate != 0.0
    reached = np.where(moves, way / np.where(moves, np.abs(state.rate), 1.0), np.inf)
    state.travel_s = np.minimum(scene.travel_s, reached)
    state.held = d / state.h
    state.give = 1.0 / (d / state.h + k)
    state.joint_k = k
    state.lag = d / k * state.rate
    state.q = equilibrium(state, 0.0) - state.lag
    state.frame = np.zeros(state.n)


STILL_M_S = 1e-6
"""What moves more slowly does not move."""


def place(state: State) -> None:
    """Put the object where the sweep meets it after the lead."""
    p, skin = state.values, state.skin
    state.row_z = skin.row0_z_m - skin.row_pitch_m * np.arange(skin.rows, dtype=float)[:, None]
    low, high = float(state.row_z.min()), float(state.row_z.max())
    state.z = np.clip(state.scene.place_m + p["place_m"], low, high)
    pose = state.kinematics.pose(equilibrium(state, p["lead_s"]) - state.lag)
    along = pose.rotation[:, 2]
    point = pose.origin + along * state.z
    arms = cross(pose.axes, (point[:, None] - pose.origins))
    rate = np.broadcast_to(state.rate[:, :, None], (len(state.rate), 1, state.n))
    speed = dot(np.moveaxis(arms, 1, 0), rate)
    speed = speed - along * dot(speed, along)
    size = np.sqrt(dot(speed, speed))
    if not (size > STILL_M_S).all():
        raise InputError(
            f"{state.scene.name}: motion.rate_deg_s does not move the forearm where it is to meet "
            "an object (motion.place_m); let a joint turn that carries it"
        )
    state.approach = size
    normal = speed / size
    yaw = np.radians(p["yaw_deg"])
    state.normal = normal * np.cos(yaw) + along * np.sin(yaw)
    state.face = point + skin.radius_m * normal
    state.along_face = along * np.cos(yaw) - normal * np.sin(yaw)
    state.meeting_angle = np.arctan2(
        dot(speed, pose.rotation[:, 1]), dot(speed, pose.rotation[:, 0])
    )
    state.force = np.zeros(state.n)
    state.loads = (np.zeros(state.n),)


def springs(state: State) -> None:
    """Each taxel is a spring; covers and foundations join it in series."""
    state.taxel_k = state.values["taxel_n_m"]


WINDOW_HALF = 6
"""Columns to either side of the one that meets the object: +-90 degrees, beyond which a
cylinder has no more surface to press."""


def window(state: State) -> None:
    """The columns that can touch: their gaps R (1 - cos theta) at zero depth."""
    skin = state.skin
    angles = np.radians(np.array(skin.column_angles_deg))[:, None]
    away = angles - state.meeting_angle
    away = np.abs(away - 2.0 * math.pi * np.round(away / (2.0 * math.pi)))
    nearest = np.argmin(away, axis=0)
    beside = min(WINDOW_HALF, (skin.cols - 1) // 2)
    state.columns = (nearest + np.arange(-beside, beside + 1)[:, None]) % skin.cols
    away = np.take_along_axis(away, state.columns, axis=0)
    state.column_gaps = skin.radius_m * (1.0 - np.cos(away))
    reach = np.where(away < 0.5 * math.pi, 1.0, 0.0)
    # A narrow face ends among the columns; no face is narrower than a taxel.
    pitch = skin.radius_m * 2.0 * math.pi / skin.cols
    half = 0.5 * np.maximum(state.values["breadth_m"], pitch)
    across = skin.radius_m * np.sin(away)
    state.reach = reach * np.clip((half + 0.5 * pitch - across) / pitch, 0.0, 1.0)


FLAT_M = 1e6
"""Radius of a face that does not curve."""


def lay_bed(state: State) -> None:
    """Lines are the skin's rows, as far as the object's face covers each."""
    offset = state.row_z - state.z
    curved = (state.values["radius_m"] < FLAT_M).any()
    state.bed = Bed(
        gaps=state.column_gaps,
        stiffness=state.reach * state.taxel_k,
        weight=covered(offset, state),
        line_gap=curve_gap(offset, state) if curved else np.zeros((1, 1)),
    )


def covered(offset: Array, state: State) -> Array:
    """(L, n) which part of each row, `offset` metres from the face's middle, the face covers."""
    pitch = state.skin.row_pitch_m
    half = 0.5 * np.maximum(state.values["width_m"], pitch)
    part: Array = np.clip((half + 0.5 * pitch - np.abs(offset)) / pitch, 0.0, 1.0)
    return part


def curve_gap(offset: Array, state: State) -> Array:
    """(L, n) how far a face curved along the forearm has drawn back: l^2 / (2 r)."""
    gap: Array = offset * offset / (2.0 * state.values["radius_m"])
    return gap


def order_bed(state: State) -> None:
    """The bed's law as lines K a - B; a flat face needs one for each column only."""
    bed = state.bed
    if len(bed.line_gap) == 1 < len(bed.weight):
        covered_rows = total(bed.weight)
        bed.slopes, bed.intercepts = sort_bed(bed.gaps, bed.stiffness * covered_rows)
        return
    all_gaps = (bed.line_gap[:, None] + bed.gaps[None]).reshape(-1, state.n)
    all_stiffness = (bed.weight[:, None] * bed.stiffness[None]).reshape(-1, state.n)
    bed.slopes, bed.intercepts = sort_bed(all_gaps, all_stiffness)


def locate(state: State) -> None:
    """Depth, its Jacobian and what the step's loads take off it, at the frame's joint angles."""
    pose = state.kinematics.pose(state.q)
    state.pose = pose
    along = pose.rotation[:, 2]
    point = pose.origin + along * state.z
    state.point = point
    normal = state.normal
    crossed = cross(normal[:, None], pose.axes)
    jacobian = dot(point[:, None] - pose.origins, crossed)
    state.q_frame = state.q
    state.jacobian = (jacobian,)
    depth = dot(point - state.face, normal) + state.skin.radius_m
    state.y_frame = (depth,)
    state.compliance = (dot(jacobian * jacobian, state.give),)


def predict(state: State) -> None:
    """Where the arm would be after the step with no load on it.

    Each joint obeys d q' + k (q - q_eq) = -J^T F; backward Euler in closed form.
    """
    state.t = state.t + state.h
    target = equilibrium(state, state.t)
    state.q_free = (state.held * state.q + state.joint_k * target) * state.give
    moved = state.q_free - state.q_frame
    state.y = tuple(y + dot(j, moved) for y, j in zip(state.y_frame, state.jacobian, strict=True))


def press(state: State) -> None:
    """The contact's loads with the object at rest."""
    state.loads = state.solve(state, state.y, state.compliance)


def settle(state: State) -> None:
    """The joints give way to the loads."""
    loads = state.loads
    torque = state.jacobian[0] * loads[0]
    for jacobian, load in zip(state.jacobian[1:], loads[1:], strict=True):
        torque = torque + jacobian * load
    state.q = state.q_free - state.give * torque
    state.depth = relieve(state.y, state.compliance, loads)


def tick(state: State) -> None:
    """The frame ends at its own time: sums of steps would drift from it."""
    state.frame = state.frame + 1.0
    state.t = state.frame / state.scene.trials["rate_hz"]


def bear(state: State) -> None:
    """The force that the skin bears, and each line's depth."""
    state.force = state.loads[0]
    state.line_depth = state.depth[0] - state.bed.line_gap


def deepest(state: State) -> Array:
    """(n,) metres to which the deepest of the lines is pressed."""
    covered = state.bed.weight > 0.0
    return np.asarray(np.where(covered, state.line_depth, 0.0).max(axis=0))


def image(state: State) -> None:
    """The force shared out among taxels: (rows, columns, n) newtons. Where a column has more
    springs than one, its first says what it bears."""
    bed, columns = state.bed, len(state.columns)
    depth = np.broadcast_to(state.line_depth, bed.weight.shape)
    loads = spring_loads(depth, bed.gaps[:columns], bed.stiffness[:columns], bed.weight)
    state.image = share_out(state.force, loads)
