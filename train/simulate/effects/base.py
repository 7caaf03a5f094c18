"""The hooks of every trial: a soft arm that follows its equilibrium point, a bed of
taxels, and the image of the load. Effects add hooks, or replace some of these
(`plan`)."""

import math

import numpy as np

from edge.errors import InputError
from train.simulate.arm import Pose, cross, dot
from train.simulate.contact import (
    closed_form,
    covered,
    curve_gap,
    share_out,
    spring_loads,
)
from train.simulate.trials import Array, Index, Trials, pick, total

STILL_M_S = 1e-6
"""A forearm slower than this counts as still."""
FLAT_M = 1e6
"""Radius of a flat face."""
FAR_M = -1e9
"""Depth of a contact whose face covers no row."""


def swing(t: Trials, i: Index) -> None:
    """Begin with the arm in its steady sweep.

    Before the contact each joint lags its equilibrium point by d/k of its speed, the
    steady solution of d q' + k (q - q_eq) = 0 for a ramp.
    """
    low, high = t.kinematics.limits
    start = np.repeat(np.array(t.scene.start)[:, None], t.n, axis=1)
    start[-1] += np.radians(t.values["roll_deg"])
    t.start[:] = np.clip(start, low, high)
    # Each joint's equilibrium point stops at the joint's limit.
    way = np.abs(np.where(t.rate > 0.0, high, low) - t.start)
    moves = t.rate != 0.0
    reached = np.where(moves, way / np.where(moves, np.abs(t.rate), 1.0), np.inf)
    t.travel_s[:] = np.minimum(t.scene.travel_s, reached)
    t.q[:] = t.equilibrium(0.0) - t.lag


def place(t: Trials, i: Index) -> None:
    """Put the object where the sweep meets it after the lead.

    Its face lies across the forearm's motion, turned by the yaw. For each column that
    it can touch this finds the gap at zero depth, R (1 - cos theta), and the part that
    the face covers.

    Raises:
        InputError: the forearm does not move at that place.
    """
    skin = t.skin
    values = t.values
    t.z[:] = t.scene.place_m + values["place_m"]
    pose = t.kinematics.pose(t.equilibrium(values["lead_s"]) - t.lag)
    along = pose.rotation[2]
    point = pose.origin + along * t.z
    turned = cross(pose.axes, point[:, None] - pose.origins) * t.rate
    speed = total(turned.swapaxes(0, 1))
    speed = speed - along * dot(speed, along)
    size = np.sqrt(dot(speed, speed))
    if not (size > STILL_M_S).all():
        raise InputError(
            f"{t.scene.name}: motion.rate_deg_s does not move the forearm where it is "
            "to meet "
            "an object (motion.place_m); turn a joint that carries it there"
        )
    normal = speed / size
    yaw = np.radians(values["yaw_deg"])
    t.normal[:] = normal * np.cos(yaw) + along * np.sin(yaw)
    t.along_face[:] = along * np.cos(yaw) - normal * np.sin(yaw)
    t.face[:] = point + skin.radius_m * normal
    angles = np.radians(np.array(skin.column_angles_deg))[:, None]
    met = np.arctan2(dot(speed, pose.rotation[1]), dot(speed, pose.rotation[0]))
    beside = angles - met - 2.0 * math.pi * np.rint((angles - met) / (2.0 * math.pi))
    away = np.abs(beside)
    window = len(t.columns)
    first = np.argmin(away, axis=0) - window // 2
    t.columns[:] = (first + np.arange(window)[:, None]) % skin.cols
    theta = np.take_along_axis(away, t.columns, axis=0)
    t.column_angle[:] = np.take_along_axis(beside, t.columns, axis=0)
    t.column_gaps[:] = skin.radius_m * (1.0 - np.cos(theta))
    # A narrow face ends between the columns.
    pitch = skin.radius_m * 2.0 * math.pi / skin.cols
    part = covered(skin.radius_m * np.sin(theta), values["breadth_m"], pitch)
    t.reach[:] = np.where(theta < 0.5 * math.pi, part, 0.0)
    t.taxel_k[:] = values["taxel_n_m"]


def lay(t: Trials, i: Index) -> None:
    """Make a line of each row of the skin, with a spring for every column."""
    lay_rows(t, i)
    t.add_springs(i, pick(t.column_gaps, i), pick(t.reach, i) * pick(t.taxel_k, i))


def lay_rows(t: Trials, i: Index) -> None:
    """Find the part of each row that the face covers, and how far the face draws back
    there."""
    offset = t.row_z - pick(t.z, i)
    radius = pick(t.values["radius_m"], i)
    t.weight[:, i] = covered(offset, pick(t.values["width_m"], i), t.skin.pitch[0])
    t.line_gap[:, i] = np.where(radius < FLAT_M, curve_gap(offset, radius), 0.0)


def law(t: Trials, i: Index) -> None:
    """The bed's law as lines K a - B; a flat face needs only one for each column."""
    trials = np.arange(t.n)[i]
    curved = t.line_gap[:, trials].any(axis=0)
    flat = trials[~curved]
    round_ = trials[curved]
    if flat.size:
        stiffness = pick(t.stiffness, flat) * total(pick(t.weight, flat))
        t.obey(flat, pick(t.gaps, flat), stiffness)
    if round_.size:
        gaps = pick(t.line_gap, round_)[:, None] + pick(t.gaps, round_)
        stiffness = pick(t.weight, round_)[:, None] * pick(t.stiffness, round_)
        shape = (-1, round_.size)
        t.obey(round_, gaps.reshape(shape), stiffness.reshape(shape))


def tune(t: Trials, i: Index) -> None:
    """Set the stiffness and the compliance of each joint within a step of this
    length."""
    step_stiffness = t.damping / pick(t.h, i)
    t.held[:, i] = step_stiffness
    t.give[:, i] = 1.0 / (step_stiffness + t.joint_k)


def locate(t: Trials, i: Index) -> None:
    """Find the depth, its Jacobian and the compliance of a step at the frame's joint
    angles."""
    q = pick(t.q, i)
    normal = pick(t.normal, i)
    face = pick(t.face, i)
    pose = t.kinematics.pose(q)
    along = pose.rotation[2]
    point = pose.origin + along * pick(t.z, i)
    lever = dot(point[:, None] - pose.origins, cross(normal[:, None], pose.axes))
    t.compliance[0, i] = total(lever * lever * pick(t.give, i))
    t.y_frame[0, i] = dot(point - face, normal) + t.skin.radius_m
    t.jacobian[:, 0, i] = lever
    keep_pose(t, i, q, point, pose)


def keep_pose(t: Trials, i: Index, q: Array, point: Array, pose: Pose) -> None:
    """Keep the arm's pose at the frame, for the effects."""
    t.q_frame[:, i] = q
    t.point[:, i] = point
    t.axes[:, :, i] = pose.axes
    t.origins[:, :, i] = pose.origins


def predict(t: Trials, i: Index) -> None:
    """Find where the arm would be after the step without load.

    Each joint obeys d q' + k (q - q_eq) = -J^T F; backward Euler in closed form.
    """
    now = pick(t.t, i) + pick(t.h, i)
    pulled = t.joint_k * t.equilibrium(now, i)
    q_free = (pick(t.held, i) * pick(t.q, i) + pulled) * pick(t.give, i)
    change = q_free - pick(t.q_frame, i)
    t.t[i] = now
    t.q_free[:, i] = q_free
    t.y[:, i] = pick(t.y_frame, i) + total(pick(t.jacobian, i) * change[:, None])


def press(t: Trials, i: Index) -> None:
    """Solve the contact's loads; an object that moves adds its compliance."""
    t.loads[:, i] = t.ask(
        i, pick(t.y[0], i), pick(t.compliance[0], i) + pick(t.soft, i)
    )


def answer(t: Trials, i: Index, y: Array, c: Array) -> Array:
    """The loads of a forearm that does not pivot, in closed form.

    With forces that depend on speed (`effects.viscous`) the force is gain F - L: the
    elastic law with a scaled compliance, beside a load that is already there. A contact
    never pulls.
    """
    law = pick(t.law_gaps, i), pick(t.slopes, i), pick(t.intercepts, i)
    if "viscous" in t.states:
        load = pick(t.states["viscous"].load[0], i)
        gain = pick(t.states["viscous"].gain, i)
        elastic = closed_form(*law, y - c * load, c * gain)
        force = gain * elastic + load
        force = np.where((elastic > 0.0) & (force > 0.0), force, 0.0)
    else:
        force = closed_form(*law, y, c)
    return np.array([force, np.zeros_like(force)])


def settle(t: Trials, i: Index) -> None:
    """Let the joints give way to the loads."""
    loads = pick(t.loads, i)
    y = pick(t.y, i)
    c = pick(t.compliance, i)
    jacobian = pick(t.jacobian, i)
    torque = jacobian[:, 0] * loads[0] + jacobian[:, 1] * loads[1]
    t.q[:, i] = pick(t.q_free, i) - pick(t.give, i) * torque
    t.depth[0, i] = y[0] - (c[0] * loads[0] + c[1] * loads[1])
    t.depth[1, i] = y[1] - (c[1] * loads[0] + c[2] * loads[1])


def bear(t: Trials, i: Index) -> None:
    """The force on the skin, and each row's depth."""
    t.force[i] = pick(t.loads[0], i)
    keep_depth(t, i, pick(t.depth[0], i) - pick(t.line_gap, i), pick(t.weight, i))


def keep_depth(t: Trials, i: Index, line_depth: Array, weight: Array) -> None:
    """Keep each row's depth, and that of the deepest row that the face covers."""
    t.line_depth[:, i] = line_depth
    t.deepest[i] = np.where(weight > 0.0, line_depth, 0.0).max(axis=0)
    t.inside[i] = np.where(weight > 0.0, line_depth, FAR_M).max(axis=0)


def image(t: Trials, i: Index) -> None:
    """Share the force among the taxels."""
    stiffness = pick(t.reach, i) * pick(t.taxel_k, i)
    loads = spring_loads(
        pick(t.line_depth, i), pick(t.column_gaps, i), stiffness, pick(t.weight, i)
    )
    share_out(pick(t.force, i), loads)
    t.image[:, :, i] = loads.swapaxes(0, 1)
