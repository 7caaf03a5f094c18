"""The forearm pivots about the contact, which adds a second coordinate: its angle to
the face.

Rows then press to different depths, a + lever * tilt, and the loads are a force and a
moment (`pivot_solver`).
"""

import numpy as np

from train.simulate.arm import cross, dot
from train.simulate.contact import covered, curve_gap, total
from train.simulate.effects import base
from train.simulate.pivot_solver import Pivots, search
from train.simulate.trials import Array, Group, Pair, PerRow, Trials


class Tilt(Group):
    """The contact of a pivoting forearm.

    Attributes:
        lever: (rows, n) metres of each row from the contact's middle.
        guess, settled: (2, n) the loads with which the next search begins, and those of
            the last step.
    """

    lever: PerRow
    guess: Pair
    settled: Pair


def law(t: Trials) -> None:
    """Each row's springs, in the order of their depth."""
    t.set_row_law(t.bed.gaps, t.bed.stiffness[:, None] * t.bed.intact)


def stand(t: Trials) -> None:
    """Begin without load."""
    t.add_state("tilt", Tilt)


def locate(t: Trials) -> None:
    """Find depth and tilt against the object's face in the frame's pose, their
    Jacobians, and the part of each row that the face covers, with its lever about the
    middle."""
    skin = t.scene.skin
    contact = t.contact
    normal = contact.normal
    face = contact.face
    along_face = contact.along_face
    along = t.arm.along
    away = t.arm.tip - face
    tilt = dot(normal, along)
    z = np.clip(-dot(away, along), skin.row_z[-1], skin.row_z[0])
    on_face = dot(away, along_face) + skin.row_z * dot(along, along_face)
    t.bed.weight = covered(on_face, t.values["width_m"], skin.pitch[0])
    t.bed.line_gap = curve_gap(on_face, t.values["radius_m"])
    t.states["tilt"].lever = skin.row_z - z
    point = t.arm.tip + along * z
    upright = np.sqrt(1.0 - tilt * tilt)
    crossed = cross(normal[:, None], t.arm.axes)
    turn = dot(along[:, None], crossed)
    push = dot(point[:, None] - t.arm.origins, crossed)
    push = push - skin.radius_m * tilt / upright * turn
    jacobian = np.stack([push, turn], axis=1)
    compliance = jacobian * t.arm.step_compliance[:, None]
    c00, c01 = total(push[:, None] * compliance)
    contact.jacobian = jacobian
    contact.compliance = np.array([c00, c01, total(turn * compliance[:, 1])])
    depth = dot(point - face, normal) + skin.radius_m * upright
    contact.y_frame = np.array([depth, tilt])
    t.arm.point = point


def answer(t: Trials, y: Array, c: Array) -> Array:
    """The loads (F, M) at which arm and bed agree."""
    tilt = t.states["tilt"]
    bed = t.bed
    law = t.row_law()
    pivots = Pivots(
        law.gaps,
        law.stiffness,
        bed.weight,
        bed.line_gap,
        tilt.lever,
        bed.gain,
        bed.load,
        free=np.array([y, t.contact.y[1]]),
        c=np.array([c, *t.contact.compliance[1:]]),
    )
    loads, bed.row_force, lost = search(pivots, tilt.guess)
    bed.lost |= lost
    return loads


def share(t: Trials) -> None:
    """The force on each row stays as the search has found it."""


def settle(t: Trials) -> None:
    """Guess the next loads by extrapolating the last two."""
    tilt = t.states["tilt"]
    loads = t.contact.loads
    tilt.guess = 2.0 * loads - tilt.settled
    tilt.settled = loads


def bear(t: Trials) -> None:
    """The force on the skin, the push's component along the skin's normal, and each
    row's depth."""
    depth, tilt = t.contact.depth
    t.touch.force = t.contact.loads[0] * np.sqrt(np.maximum(1.0 - tilt * tilt, 0.0))
    base.keep_depth(t, depth + t.states["tilt"].lever * tilt - t.bed.line_gap)
