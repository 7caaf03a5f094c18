"""The forearm pivots about the contact: a second coordinate, the angle against the face.

Rows then press to different depths, a + lever * tilt, and the loads are a force and a moment
(`pivot_solver`).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from train.simulate import base, base_steps
from train.simulate.base_steps import crossed, deepest, pose
from train.simulate.compiled import vector
from train.simulate.contact import by_depth, covered, curve_gap
from train.simulate.pivot_solver import GUARDED_ROUNDS, PIVOT, pivot_of, search
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import compiled


def add(build: Build) -> None:
    """Take the place of the base's geometry, solver and line depths."""
    bursts = "pop" in build.effects

    def upright(state: State) -> None:
        """No load yet."""
        column, gaps, stiffness = by_depth(state.bed.gaps, state.bed.stiffness)
        none = np.zeros((state.skin.rows, state.n))
        state.trial.coordinates = 2
        state.begin(
            PIVOT,
            springs=len(gaps),
            gaps=state.lend("pivot_gaps", gaps),
            stiffness=state.lend("pivot_stiffness", stiffness),
            column=state.lend("pivot_column", column),
            alive=state.trial.alive,
            bursts=bursts,
            rows=state.skin.rows,
            **{name: state.lend(name, none) for name in ("lever", "held", "out")},
            gain=1.0,
            guarded_rounds=GUARDED_ROUNDS,
        )

    def lay(state: State) -> None:
        """The rows are those of the bed."""
        own = state.of(PIVOT)
        own.weight, own.line_gap = state.trial.weight, state.trial.line_gap

    build.replace(base.order_bed, upright)
    build.replace(base_steps.locate, pivot)
    build.replace(base_steps.bear, bear)
    build.put("setup", base.HAND_OVER + 2, lay)
    build.put("step", base.SETTLE + 20, remember)
    build.wrap(solve)


@compiled
def pivot(t: Any) -> None:
    """Depth and tilt against the object's face at the frame's joint angles, with their
    Jacobians; which rows the face covers, and their levers about its middle."""
    pose(t)
    own = pivot_of(t)
    row_z, lever = vector(t.row_z, t.rows), vector(own.lever, t.rows)
    weight, line_gap = vector(t.weight, t.rows), vector(t.line_gap, t.rows)
    radius, turned = t.skin_radius_m, t.rotation
    z, tilt, from_middle, across = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        away = t.origin[i] - t.face[i]
        z -= away * turned[i, 2]
        tilt += t.normal[i] * turned[i, 2]
        from_middle += away * t.along_face[i]
        across += turned[i, 2] * t.along_face[i]
    z = min(max(z, row_z[t.rows - 1]), row_z[0])
    upright = math.sqrt(1.0 - tilt * tilt)
    for row in range(t.rows):
        on_face = from_middle + row_z[row] * across
        weight[row] = covered(on_face, t.width_m, t.row_pitch_m)
        line_gap[row] = curve_gap(on_face, t.face_radius_m)
        lever[row] = row_z[row] - z
    depth = 0.0
    for i in range(3):
        t.point[i] = t.origin[i] + turned[i, 2] * z
        depth += (t.origin[i] - t.face[i] + turned[i, 2] * z) * t.normal[i]
    t.compliance[0], t.compliance[1], t.compliance[2] = 0.0, 0.0, 0.0
    for j in range(t.joints):
        push, turn = 0.0, 0.0
        cross = crossed(t.normal, t.axes, j)
        for i in range(3):
            turn += turned[i, 2] * cross[i]
            push += (t.point[i] - t.origins[i, j]) * cross[i]
        push -= radius * tilt / upright * turn
        t.jacobian[0, j], t.jacobian[1, j] = push, turn
        t.compliance[0] += push * push * t.give[j]
        t.compliance[1] += push * turn * t.give[j]
        t.compliance[2] += turn * turn * t.give[j]
        t.q_frame[j] = t.q[j]
    t.y_frame[0], t.y_frame[1] = depth + radius * upright, tilt


@compiled
def bear(t: Any) -> None:
    """The force that the skin bears, which is what of the push goes along its own normal, and each
    line's depth."""
    tilt = t.depth[1]
    t.force = t.loads[0] * math.sqrt(max(1.0 - tilt * tilt, 0.0))
    lever = vector(pivot_of(t).lever, t.rows)
    line_depth, line_gap = vector(t.line_depth, t.rows), vector(t.line_gap, t.rows)
    for row in range(t.rows):
        line_depth[row] = t.depth[0] + lever[row] * tilt - line_gap[row]
    deepest(t)


@compiled
def remember(t: Any) -> None:
    """The next step's loads will go on as these did."""
    own = pivot_of(t)
    for i in range(2):
        own.guess[i] = 2.0 * t.loads[i] - own.settled[i]
        own.settled[i] = t.loads[i]


@compiled
def solve(t: Any) -> None:
    """The loads (F, M) at which arm and bed agree."""
    own = pivot_of(t)
    own.free0, own.free1 = t.free[0], t.free[1]
    own.c00, own.c01, own.c11 = t.c[0], t.c[1], t.c[2]
    search(own)
    t.found[0], t.found[1] = own.force, own.moment
    if own.lost:
        t.lost = 1.0
