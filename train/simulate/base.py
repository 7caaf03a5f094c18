"""What every trial runs: the soft arm that follows its equilibrium point, the bed of taxels,
and the image of the load. Effects add to it, or take the place of one of its functions."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from edge.errors import InputError
from train.simulate import base_steps
from train.simulate.arm import dot, pose_of
from train.simulate.compiled import Array, addresses
from train.simulate.contact import covered, curve_gap, total
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


def swing(state: State) -> None:
    """Set the arm in its steady sweep.

    Before the contact each joint lags its equilibrium point by d/k of its speed: the steady
    answer of d q' + k (q - q_eq) = 0 to a ramp.
    """
    scene = state.scene
    k = np.array(scene.stiffness)[:, None]
    d = np.array(scene.damping)[:, None]
    low, high = state.scene.kinematics.limits
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
WINDOW_HALF = 6
"""Columns to either side of the one that meets the object: +-90 degrees, beyond which a
cylinder has no more surface to press."""


def beside(skin: Cylinder) -> int:
    """How many columns to either side of the one that meets the object can touch."""
    return min(WINDOW_HALF, (skin.cols - 1) // 2)


def place(state: State) -> None:
    """Put the object where the sweep meets it after the lead, before the columns it can touch."""
    values, skin, columns = state.values, state.skin, 2 * beside(state.skin) + 1
    state.row_z = skin.row0_z_m - skin.row_pitch_m * np.arange(skin.rows, dtype=float)[:, None]
    state.records["z"] = state.z = state.scene.place_m + values["place_m"]
    state.columns = np.zeros((columns, state.n), dtype=np.intp)
    state.column_gaps, state.reach = np.zeros((2, columns, state.n))
    moves = meet(
        state.records,
        state.scene.kinematics.table,
        equilibrium(state, values["lead_s"]) - state.lag,
        state.rate[:, 0],
        np.radians(values["yaw_deg"]),
        values["breadth_m"],
        skin.radius_m,
        np.radians(np.array(skin.column_angles_deg)),
        state.columns,
        state.column_gaps,
        state.reach,
    )
    if not moves:
        raise InputError(
            f"{state.scene.name}: motion.rate_deg_s does not move the forearm where it is to meet "
            "an object (motion.place_m); let a joint turn that carries it"
        )


@njit(cache=True, error_model="numpy")
def meet(
    trials: NDArray[Any],
    table: Array,
    q: Array,
    rate: Array,
    yaw: Array,
    breadth: Array,
    radius: float,
    angles: Array,
    columns: NDArray[np.intp],
    gaps: Array,
    reach: Array,
) -> bool:
    """Each trial's face, across the way of the forearm and turned by its yaw, and the columns that
    it can touch (columns, n): which these are, how far they lie back at zero depth,
    R (1 - cos theta), and which part of each the face covers.

    Returns:
        Whether every forearm moves there.
    """
    speed, away, around = np.zeros(3), np.zeros(len(angles)), 2.0 * math.pi
    for i in range(len(trials)):
        t = trials[i]
        pose_of(table, q[:, i], t.origin, t.rotation, t.axes, t.origins)
        along, point = t.rotation[:, 2], t.origin + t.rotation[:, 2] * t.z
        speed[:] = 0.0
        for j in range(len(rate)):
            for k, m, n in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
                turned = t.axes[m, j] * (point[n] - t.origins[n, j])
                turned -= t.axes[n, j] * (point[m] - t.origins[m, j])
                speed[k] += turned * rate[j]
        speed -= along * dot(speed, along)
        size = math.sqrt(dot(speed, speed))
        if not size > STILL_M_S:
            return False
        for k in range(3):
            normal = speed[k] / size
            t.normal[k] = normal * math.cos(yaw[i]) + along[k] * math.sin(yaw[i])
            t.face[k] = point[k] + radius * normal
            t.along_face[k] = along[k] * math.cos(yaw[i]) - normal * math.sin(yaw[i])
        met = math.atan2(dot(speed, t.rotation[:, 1]), dot(speed, t.rotation[:, 0]))
        for c in range(len(angles)):
            apart = angles[c] - met
            away[c] = abs(apart - around * np.rint(apart / around))
        first = np.argmin(away) - len(columns) // 2
        for c in range(len(columns)):
            column = (first + c) % len(angles)
            theta = away[column]
            columns[c, i] = column
            gaps[c, i] = radius * (1.0 - math.cos(theta))
            # A narrow face ends among the columns.
            part = covered(radius * math.sin(theta), breadth[i], radius * around / len(angles))
            reach[c, i] = part if theta < 0.5 * math.pi else 0.0
    return True


def springs(state: State) -> None:
    """Each taxel is a spring; covers and foundations join it in series."""
    state.taxel_k = state.values["taxel_n_m"]


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
        state.obey(bed.gaps, bed.stiffness * total(bed.weight))
        return
    all_gaps = (bed.line_gap[:, None] + bed.gaps[None]).reshape(-1, state.n)
    all_stiffness = (bed.weight[:, None] * bed.stiffness[None]).reshape(-1, state.n)
    state.obey(all_gaps, all_stiffness)


def hand_over(state: State) -> None:
    """Give each trial's record what the setup has found; from here on it is the trial."""
    skin, bed, values, n = state.skin, state.bed, state.values, state.n
    dof, lines, columns = len(state.q), len(bed.weight), len(state.columns)
    rate_hz, none = state.scene.trials["rate_hz"], np.zeros((lines, n))
    of_rows = {
        "weight": bed.weight,
        "line_gap": bed.line_gap + none,
        "line_depth": none,
        "gaps": bed.gaps,
        "stiffness": bed.stiffness,
        "column_gaps": state.column_gaps,
        "reach": state.reach,
        "image": np.zeros((skin.rows, columns, n)),
    }
    numbers = {
        "steps": state.steps,
        "h": 1.0 / (rate_hz * state.steps),
        "rate_hz": rate_hz,
        "joints": dof,
        "chain": addresses(state.scene.kinematics.table)[0],
        "row_z": addresses(state.row_z)[0],
        "taxel_k": state.taxel_k,
        "width_m": values["width_m"],
        "face_radius_m": values["radius_m"],
        "skin_radius_m": skin.radius_m,
        "row_pitch_m": skin.row_pitch_m,
        "rows": skin.rows,
        "lines": lines,
        "columns": columns,
        "springs": len(bed.gaps),
        **{name: state.lend(name, array) for name, array in of_rows.items()},
    }
    trial = state.records
    for name, value in numbers.items():
        trial[name] = value
    for name in ("start", "rate", "travel_s", "damping", "joint_k", "q"):
        trial[name][:, :dof] = getattr(state, name).T
    trial["coordinates"] = np.maximum(trial["coordinates"], 1)
