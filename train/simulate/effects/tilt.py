"""The forearm pivots about the contact: a second coordinate, the angle against the face.

Rows then press to different depths, a + lever * tilt, and the loads are a force and a moment
(`pivot_solver`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from edge.errors import EdgeError
from train.simulate import base, pivot_solver
from train.simulate.arm import cross, dot
from train.simulate.contact import Array, Coordinates, Springs, sorted_springs
from train.simulate.pivot_solver import GUARDED_ROUNDS
from train.simulate.plan import Build
from train.simulate.state import State


@dataclass
class Tilt:
    """The pivoting forearm's own state.

    Attributes:
        guess: loads with which the next step's search begins.
        settled: loads of the step before.
        springs: the bed's, by depth.
        lever: (L, n) metres along the forearm from the face's middle to each line.
    """

    guess: Coordinates
    settled: Coordinates
    springs: Springs
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
    springs = sorted_springs(state.bed.gaps, state.bed.stiffness)
    state.keep(Tilt(state.loads, state.loads, springs, np.zeros((1, state.n))))


def pivot(state: State) -> None:
    """Depth and tilt against the object's face at the frame's joint angles, with their
    Jacobians; which rows the face covers, and their levers about its middle."""
    skin = state.skin
    pose = state.kinematics.pose(state.q)
    state.pose = pose
    along, normal = pose.rotation[:, 2], state.normal
    row_z = state.row_z
    away = pose.origin - state.face
    z = np.clip(-dot(away, along), row_z.min(axis=0), row_z.max(axis=0))
    tilt = dot(normal, along)
    upright = np.sqrt(1.0 - tilt * tilt)
    on_face = dot(away, state.along_face) + row_z * dot(along, state.along_face)
    state.bed.weight = base.covered(on_face, state)
    state.bed.line_gap = base.curve_gap(on_face, state)
    state.of(Tilt).lever = row_z - z
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
    depths: Array = depth + state.of(Tilt).lever * tilt - state.bed.line_gap
    return depths


def bear(state: State) -> None:
    """The force that the skin bears, which is what of the push goes along its own normal, and each
    line's depth."""
    tilt = state.depth[1]
    state.force = state.loads[0] * np.sqrt(np.maximum(1.0 - tilt * tilt, 0.0))
    state.line_depth = line_depths(state)


def remember(state: State) -> None:
    """The next step's loads will go on as these did."""
    own, loads = state.of(Tilt), state.loads
    own.guess = tuple(2.0 * new - old for new, old in zip(loads, own.settled, strict=True))
    own.settled = loads


def solve(state: State, free: Coordinates, c: Coordinates) -> Coordinates:
    """The loads (F, M) at which arm and bed agree."""
    own = state.of(Tilt)
    springs = state.bed.lines_of(own.springs, own.lever)
    return search(springs, own.guess, free, c, where=state.scene.name)


def search(
    springs: Springs, guess: Coordinates, free: Coordinates, c: Coordinates, where: str = "tilt"
) -> Coordinates:
    """The loads (F, M) with y = free - C (F, M), searched for from a guess of them; `where` names
    the scene in errors.

    Raises:
        EdgeError: they were not found.
    """
    tape = getattr(free[0], "tape", None)
    if tape is None:
        force, moment, lost = pivot_solver.search(springs, guess, free, c, GUARDED_ROUNDS)
    else:
        given = (*springs, *guess, *free, *c)
        sizes = (free[0].shape,) * 3
        force, moment, lost = tape.call(pivot_solver.taped_search, given, sizes)
    if lost.any():
        count = np.count_nonzero(np.asarray(lost))
        raise EdgeError(
            f"{where}: how far the forearm tilts was not found for {count} contacts; "
            "give skin.taxel_n_m, the object's stiffness or [step_s] less extreme values"
        )
    return force, moment


def line_forces(state: State) -> Array:
    """(L, n) newtons that each line bears."""
    own = state.of(Tilt)
    springs = state.bed.lines_of(own.springs, own.lever)
    tape = getattr(state.depth[0], "tape", None)
    if tape is None:
        return np.asarray(pivot_solver.line_forces(springs, state.depth))
    given = (*springs, *state.depth)
    forces: Array = tape.call(pivot_solver.taped_line_forces, given, (springs.weight.shape,))[0]
    return forces
