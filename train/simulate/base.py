"""What every trial runs: the soft arm that follows its equilibrium point, the bed of taxels,
and the image of the load. Effects add to it, or take the place of one of its functions."""

from __future__ import annotations

import math

import numpy as np

from edge.errors import InputError
from edge.touch.arm import Chain
from train.simulate import base_steps
from train.simulate.arm import cross, dot
from train.simulate.compiled import Array, addresses
from train.simulate.contact import covered, curve_gap, sort_bed, total
from train.simulate.plan import Build
from train.simulate.scene_model import Cylinder
from train.simulate.state import Bed, State

# Ranks within the stages; effects put themselves between.
SWING, PLACE, SPRINGS, WINDOW, BED, ORDER, HAND_OVER = 0, 5, 10, 30, 40, 60, 200
LOCATE = 10
PREDICT, PRESS, SETTLE = 10, 30, 60
TICK, BEAR, IMAGE = 0, 10, 30


def add(build: Build) -> None:
    """Put the base's functions into the plan."""
    build.wrap(base_steps.solve)
    build.press = base_steps.press
    build.put("setup", SWING, swing)
    build.put("setup", PLACE, place)
    build.put("setup", SPRINGS, springs)
    build.put("setup", WINDOW, window)
    build.put("setup", BED, lay_bed)
    build.put("setup", ORDER, order_bed)
    build.put("setup", HAND_OVER, hand_over)
    build.put("tune", LOCATE, base_steps.tune)
    build.put("frame", LOCATE, base_steps.locate)
    build.put("step", PREDICT, base_steps.predict)
    build.put("step", PRESS, base_steps.press)
    build.put("step", SETTLE, base_steps.settle)
    build.put("sample", TICK, base_steps.tick)
    build.put("sample", BEAR, base_steps.bear)
    build.put("sample", IMAGE, base_steps.image)
    build.trace("depth_m", None, "deepest")


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
    state.damping, state.joint_k = d, k
    state.lag = d / k * state.rate
    state.q = equilibrium(state, 0.0) - state.lag


STILL_M_S = 1e-6
"""What moves more slowly does not move."""


def place(state: State) -> None:
    """Put the object where the sweep meets it after the lead."""
    p, skin = state.values, state.skin
    state.row_z = skin.row0_z_m - skin.row_pitch_m * np.arange(skin.rows, dtype=float)[:, None]
    state.z = state.scene.place_m + p["place_m"]
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


def springs(state: State) -> None:
    """Each taxel is a spring; covers and foundations join it in series."""
    state.taxel_k = state.values["taxel_n_m"]


WINDOW_HALF = 6
"""Columns to either side of the one that meets the object: +-90 degrees, beyond which a
cylinder has no more surface to press."""


def beside(skin: Cylinder) -> int:
    """How many columns to either side of the one that meets the object can touch."""
    return min(WINDOW_HALF, (skin.cols - 1) // 2)


def window(state: State) -> None:
    """The columns that can touch: their gaps R (1 - cos theta) at zero depth."""
    skin = state.skin
    angles = np.radians(np.array(skin.column_angles_deg))[:, None]
    away = angles - state.meeting_angle
    away = np.abs(away - 2.0 * math.pi * np.round(away / (2.0 * math.pi)))
    nearest = np.argmin(away, axis=0)
    away_by = np.arange(-beside(skin), beside(skin) + 1)[:, None]
    state.columns = (nearest + away_by) % skin.cols
    away = np.take_along_axis(away, state.columns, axis=0)
    state.column_gaps = skin.radius_m * (1.0 - np.cos(away))
    reach = np.where(away < 0.5 * math.pi, 1.0, 0.0)
    # A narrow face ends among the columns.
    pitch = skin.radius_m * 2.0 * math.pi / skin.cols
    across = skin.radius_m * np.sin(away)
    state.reach = reach * covered(across, state.values["breadth_m"], pitch)


FLAT_M = 1e6
"""Radius of a face that does not curve."""


def lay_bed(state: State) -> None:
    """Lines are the skin's rows, as far as the object's face covers each."""
    offset = state.row_z - state.z
    curved = (state.values["radius_m"] < FLAT_M).any()
    state.bed = Bed(
        gaps=state.column_gaps,
        stiffness=state.reach * state.taxel_k,
        weight=covered(offset, state.values["width_m"], state.skin.row_pitch_m),
        line_gap=curve_gap(offset, state.values["radius_m"]) if curved else np.zeros((1, 1)),
    )


def order_bed(state: State) -> None:
    """The bed's law as lines K a - B; a flat face needs one for each column only."""
    bed = state.bed
    if len(bed.line_gap) == 1 < len(bed.weight):
        covered_rows = total(bed.weight)
        law = sort_bed(bed.gaps, bed.stiffness * covered_rows)
        bed.law_gaps, bed.slopes, bed.intercepts = law
        return
    all_gaps = (bed.line_gap[:, None] + bed.gaps[None]).reshape(-1, state.n)
    all_stiffness = (bed.weight[:, None] * bed.stiffness[None]).reshape(-1, state.n)
    bed.law_gaps, bed.slopes, bed.intercepts = sort_bed(all_gaps, all_stiffness)


def hand_over(state: State) -> None:
    """Give each trial's record what the setup has found; from here on it is the trial."""
    skin, bed, values, n = state.skin, state.bed, state.values, state.n
    dof, lines, columns = len(state.q), len(bed.weight), len(state.columns)
    rate_hz = state.scene.trials["rate_hz"]
    of_rows = {
        "row_z": np.broadcast_to(state.row_z, (skin.rows, n)),
        "weight": bed.weight,
        "line_gap": np.broadcast_to(bed.line_gap, bed.weight.shape),
        "line_depth": np.zeros((lines, n)),
        "gaps": bed.gaps,
        "stiffness": bed.stiffness,
        "column_gaps": state.column_gaps,
        "reach": state.reach,
        "law_gaps": bed.law_gaps,
        "slopes": bed.slopes,
        "intercepts": bed.intercepts,
        "image": np.zeros((skin.rows, columns, n)),
    }
    numbers = {
        "steps": state.steps,
        "h": 1.0 / (rate_hz * state.steps),
        "rate_hz": rate_hz,
        "joints": dof,
        "chain": addresses(state.kinematics.table)[0],
        "z": state.z,
        "taxel_k": state.taxel_k,
        "width_m": values["width_m"],
        "face_radius_m": values["radius_m"],
        "skin_radius_m": skin.radius_m,
        "row_pitch_m": skin.row_pitch_m,
        "rows": skin.rows,
        "lines": lines,
        "columns": columns,
        "springs": len(bed.gaps),
        "law_lines": len(bed.slopes),
        **{name: getattr(state, name).T for name in ("normal", "face", "along_face")},
        **{name: state.lend(name, array) for name, array in of_rows.items()},
    }
    trial = state.records
    for name, value in numbers.items():
        trial[name] = value
    for name in ("start", "rate", "travel_s", "damping", "joint_k", "q"):
        trial[name][:, :dof] = getattr(state, name).T
    trial["coordinates"] = np.maximum(trial["coordinates"], 1)
