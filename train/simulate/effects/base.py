"""The hooks of every trial: a soft arm that follows its equilibrium point, a bed of
taxels, and the image of the load. Effects add hooks, or replace some of these
(`plan`)."""

import math

import numpy as np

from edge.errors import InputError
from train.simulate.arm import cross, dot
from train.simulate.contact import (
    closed_form,
    covered,
    curve_gap,
    share_out,
    spring_loads,
    total,
)
from train.simulate.schema import RATE_DEG_S
from train.simulate.trials import Array, Trials

STILL_M_S = 1e-6
"""A forearm slower than this counts as still."""
FLAT_M = 1e6
"""Radius of a flat face."""
FAR_M = -1e9
"""Depth of a contact whose face covers no row."""
PUSHES_S = 0.2
"""Time for which an arm that may halt pushes on at least."""


def swing(t: Trials) -> None:
    """Begin with the arm in its steady sweep.

    Before the contact each joint lags its equilibrium point by d/k of its speed, the
    steady solution of d q' + k (q - q_eq) = 0 for a ramp.
    """
    low, high = t.scene.kinematics.limits
    rate = np.repeat(np.array(t.scene.rate)[:, None], len(t), axis=1)
    for joint in range(len(rate)):
        if (name := f"{RATE_DEG_S}.{joint}") in t.scene.values:
            rate[joint] += np.radians(t.values[name])
    t.arm.rate = rate
    t.arm.lag = t.joints.damping / t.joints.stiffness * rate
    start = np.repeat(np.array(t.scene.start)[:, None], len(t), axis=1)
    start[-1] += np.radians(t.values["roll_deg"])
    start = np.clip(start, low, high)
    # Each joint's equilibrium point stops at the joint's limit.
    way = np.abs(np.where(rate > 0.0, high, low) - start)
    moves = rate != 0.0
    reached = np.where(moves, way / np.where(moves, np.abs(rate), 1.0), np.inf)
    t.arm.start = start
    travel_s = t.scene.travel_s
    if "travel_s" in t.scene.values:
        least = t.values["lead_s"] + PUSHES_S
        travel_s = np.maximum(t.values["travel_s"], least)
    t.arm.travel_s = np.minimum(travel_s, reached)
    t.arm.q = t.equilibrium(0.0) - t.arm.lag


def place(t: Trials) -> None:
    """Put the object where the sweep meets it after the lead.

    Its face lies across the forearm's motion, turned by the yaw. For each column that
    it can touch this finds the gap at zero depth, R (1 - cos theta), and the part that
    the face covers.

    Raises:
        InputError: the forearm does not move at that place.
    """
    skin = t.scene.skin
    values = t.values
    z = t.scene.place_m + values["place_m"]
    pose = t.scene.kinematics.pose(t.equilibrium(values["lead_s"]) - t.arm.lag)
    along = pose.rotation[2]
    point = pose.origin + along * z
    turned = cross(pose.axes, point[:, None] - pose.origins) * t.arm.rate
    speed = total(turned.swapaxes(0, 1))
    speed = speed - along * dot(speed, along)
    size = np.sqrt(dot(speed, speed))
    if not (size > STILL_M_S).all():
        raise InputError(
            f"{t.scene.name}: motion.rate_deg_s does not move the forearm where it is "
            "to meet an object (motion.place_m); turn a joint that carries it there"
        )
    normal = speed / size
    yaw = np.radians(values["yaw_deg"])
    t.contact.z = z
    t.contact.normal = normal * np.cos(yaw) + along * np.sin(yaw)
    t.contact.along_face = along * np.cos(yaw) - normal * np.sin(yaw)
    t.contact.face = point + skin.radius_m * normal
    front = np.arctan2(dot(speed, pose.rotation[1]), dot(speed, pose.rotation[0]))
    lay_columns(t, front)


def lay_columns(t: Trials, front: Array) -> None:
    """Choose the columns that can touch an object at the front, an angle (m,) around the
    forearm."""
    skin = t.scene.skin
    bed = t.bed
    angles = np.radians(np.array(skin.column_angles_deg))[:, None]
    beside = (
        angles - front - 2.0 * math.pi * np.rint((angles - front) / (2.0 * math.pi))
    )
    away = np.abs(beside)
    window = len(bed.columns)
    first = np.argmin(away, axis=0) - window // 2
    columns = (first + np.arange(window)[:, None]) % skin.cols
    theta = np.take_along_axis(away, columns, axis=0)
    # A narrow face ends between the columns.
    pitch = skin.radius_m * 2.0 * math.pi / skin.cols
    part = covered(skin.radius_m * np.sin(theta), t.values["breadth_m"], pitch)
    bed.columns = columns
    bed.column_angle = np.take_along_axis(beside, columns, axis=0)
    bed.column_gaps = skin.radius_m * (1.0 - np.cos(theta))
    bed.reach = np.where(theta < 0.5 * math.pi, part, 0.0)
    bed.taxel_k = t.values["taxel_n_m"]


def lay(t: Trials) -> None:
    """Make a line of each row of the skin, with a spring for every column."""
    lay_rows(t)
    t.add_springs(t.bed.column_gaps, t.bed.reach * t.bed.taxel_k)


def lay_rows(t: Trials) -> None:
    """Find the part of each row that the face covers, and how far the face draws back
    there."""
    offset = t.scene.skin.row_z - t.contact.z
    radius = t.values["radius_m"]
    t.bed.weight = covered(offset, t.values["width_m"], t.scene.skin.pitch[0])
    t.bed.line_gap = np.where(radius < FLAT_M, curve_gap(offset, radius), 0.0)


def law(t: Trials) -> None:
    """The bed's law as lines K a - B; a flat face needs only one for each column."""
    curved = np.any(t.bed.line_gap, axis=0)
    if curved.any():
        curved_law(t.only(curved))
    if not curved.all():
        flat_law(t.only(~curved))


def flat_law(t: Trials) -> None:
    """The law of columns that all rows share."""
    t.set_bed_law(t.bed.gaps, t.bed.stiffness * total(t.bed.weight))


def curved_law(t: Trials) -> None:
    """The law of each row's own springs."""
    gaps = t.bed.line_gap[:, None] + t.bed.gaps
    stiffness = t.bed.weight[:, None] * t.bed.stiffness
    t.set_bed_law(gaps.reshape(-1, len(t)), stiffness.reshape(-1, len(t)))


def tune(t: Trials) -> None:
    """Set the stiffness and the compliance of each joint within a step of this
    length."""
    step_stiffness = t.joints.damping / t.clock.h
    t.arm.step_stiffness = step_stiffness
    t.arm.step_compliance = 1.0 / (step_stiffness + t.joints.stiffness)


def stretch_out(t: Trials) -> None:
    """Find the arm's pose at the frame's joint angles."""
    q = t.arm.q
    pose = t.scene.kinematics.pose(q)
    t.arm.q_frame = q
    t.arm.tip = pose.origin
    t.arm.along = pose.rotation[2]
    t.arm.axes = pose.axes
    t.arm.origins = pose.origins


def locate(t: Trials) -> None:
    """Find the depth, its Jacobian and the compliance of a step in the frame's pose."""
    contact = t.contact
    normal = contact.normal
    point = t.arm.tip + t.arm.along * contact.z
    lever = dot(point[:, None] - t.arm.origins, cross(normal[:, None], t.arm.axes))
    depth = dot(point - contact.face, normal) + t.scene.skin.radius_m
    compliance = total(lever * lever * t.arm.step_compliance)
    zeros = np.zeros_like(depth)
    contact.y_frame = np.array([depth, zeros])
    contact.compliance = np.array([compliance, zeros, zeros])
    contact.jacobian = np.stack([lever, np.zeros_like(lever)], axis=1)
    t.arm.point = point


def predict(t: Trials) -> None:
    """Find where the arm would be after the step without load.

    Each joint obeys d q' + k (q - q_eq) = -J^T F; backward Euler in closed form.
    """
    arm = t.arm
    now = t.clock.t + t.clock.h
    pulled = t.joints.stiffness * t.equilibrium(now)
    q_free = (arm.step_stiffness * arm.q + pulled) * arm.step_compliance
    change = q_free - arm.q_frame
    t.clock.t = now
    arm.q_free = q_free
    t.contact.y = t.contact.y_frame + total(t.contact.jacobian * change[:, None])


def press(t: Trials) -> None:
    """Solve the contact's loads; an object that moves adds its compliance."""
    contact = t.contact
    t.contact.loads = t.solve_loads(
        contact.free_depth, contact.compliance[0] + contact.soft
    )


def answer(t: Trials, y: Array, c: Array) -> Array:
    """The loads of a forearm that does not pivot, in closed form.

    With forces that depend on speed the force is gain F + load: the elastic law with a
    scaled compliance, beside a load that is already there. A contact never pulls.
    """
    bed = t.bed
    gain = bed.gain
    load = bed.load[0]
    elastic = closed_form(
        bed.law_gaps,
        bed.slopes,
        bed.intercepts,
        y - c * load,
        c * gain,
    )
    force = gain * elastic + load
    force = np.where((elastic > 0.0) & (force > 0.0), force, 0.0)
    return np.array([force, np.zeros_like(force)])


def share(t: Trials) -> None:
    """Let the first row hold the whole force."""
    t.bed.first_row_force = t.contact.loads[0]


def settle(t: Trials) -> None:
    """Let the joints give way to the loads."""
    contact = t.contact
    force, moment = contact.loads
    c00, c01, c11 = contact.compliance
    jacobian = contact.jacobian
    torque = jacobian[:, 0] * force + jacobian[:, 1] * moment
    way = np.array([c00 * force + c01 * moment, c01 * force + c11 * moment])
    t.arm.q = t.arm.q_free - t.arm.step_compliance * torque
    contact.depth = contact.y - way


def bear(t: Trials) -> None:
    """The force on the skin, and each row's depth."""
    t.touch.force = t.contact.loads[0]
    keep_depth(t, t.contact.depth[0] - t.bed.line_gap)


def keep_depth(t: Trials, line_depth: Array) -> None:
    """Keep each row's depth, and that of the deepest row that the face covers."""
    on_face = t.bed.weight > 0.0
    t.touch.line_depth = line_depth
    t.touch.deepest = np.where(on_face, line_depth, 0.0).max(axis=0)
    t.touch.inside = np.where(on_face, line_depth, FAR_M).max(axis=0)


def image(t: Trials) -> None:
    """Share the force among the taxels."""
    bed = t.bed
    stiffness = bed.reach * bed.taxel_k
    loads = spring_loads(t.touch.line_depth, bed.column_gaps, stiffness, bed.weight)
    share_out(t.touch.force, loads)
    t.touch.image = loads.swapaxes(0, 1)


def trace(t: Trials) -> dict[str, Array]:
    """The depth of the deepest row."""
    return {"depth_m": t.touch.deepest}
