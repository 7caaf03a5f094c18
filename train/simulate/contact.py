"""The bed of springs between skin and object: its law, and the step that cannot blow up.

A bed is L lines (rows of the skin, or stems) of C springs (columns around the forearm). At
depth d a line bears sum_c k_c max(0, d - line_gap - gap_c) times its weight. As a function of
the depth a of the whole bed this is convex and piecewise linear, phi(a) = max_s(K_s a - B_s),
so an implicit step has a closed form (`closed_form`).

Coordinates of a contact are y = (a,), or (a, tilt) where the forearm pivots; loads are (F,),
or (F, M); C = (c00,) or (c00, c01, c11) is what a unit load takes off y within the step.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Coordinates = tuple[Array, ...]


class Springs(NamedTuple):
    """The springs of n trials, for a solver that takes them trial by trial.

    Attributes:
        gaps, stiffness: (n, C) metres at which a spring is touched, ascending; newtons a metre.
        column: (n, C) which of the bed's springs each is.
        weight, line_gap, lever: (L, n) the part of each line that is covered, metres by which
            the face draws back there, metres from the contact's middle.
        alive: (L, C, n) 1 where one of the bed's springs bears and 0 where it does not;
            (0, 0, 0) if all do.
        gain, load: (n,) and (L, n) of what answers to speed (`viscous`); (0,) and (0, 0) if
            nothing does.
    """

    gaps: Array
    stiffness: Array
    column: NDArray[np.int64]
    weight: Array
    line_gap: Array
    lever: Array
    alive: Array
    gain: Array
    load: Array


def sorted_springs(gaps: Array, stiffness: Array) -> Springs:
    """The springs (C, n) of a bed by depth, without lines yet."""
    column = np.argsort(gaps, axis=0, kind="stable")
    none = np.zeros((0, 0))
    return Springs(
        gaps=np.ascontiguousarray(np.take_along_axis(gaps, column, axis=0).T),
        stiffness=np.ascontiguousarray(np.take_along_axis(stiffness, column, axis=0).T),
        column=np.ascontiguousarray(column.T.astype(np.int64)),
        weight=none,
        line_gap=none,
        lever=none,
        alive=np.zeros((0, 0, 0)),
        gain=np.zeros(0),
        load=none,
    )


def relieve(y: Coordinates, c: Coordinates, loads: Coordinates) -> Coordinates:
    """y - C loads."""
    if len(loads) == 1:
        return (y[0] - c[0] * loads[0],)
    force, moment = loads
    return y[0] - (c[0] * force + c[1] * moment), y[1] - (c[1] * force + c[2] * moment)


def running_sum(values: Array) -> Array:
    """Sums along the first axis, one term after the other."""
    return np.add.accumulate(values, axis=0)


def total(values: Array) -> Array:
    """The sum over the first axis, one term after the other: the same bits in any batch.

    `np.sum` adds so too, unless the batch is one wide: then it adds in pairs.
    """
    if values.shape[-1] == 1:
        last: Array = np.add.accumulate(values, axis=0)[-1]
        return last
    whole: Array = np.add.reduce(values, axis=0)
    return whole


def sort_bed(gaps: Array, stiffness: Array) -> tuple[Array, Array]:
    """Slopes K and intercepts B, (E, n) each, of phi(a) = max(0, max_s(K_s a - B_s))."""
    return bed_law(gaps, stiffness, np.argsort(gaps, axis=0, kind="stable"))


def bed_law(gaps: Array, stiffness: Array, order: NDArray[np.intp]) -> tuple[Array, Array]:
    """`sort_bed`, where the springs' order (E, n) by their gaps is known."""
    gaps = np.take_along_axis(gaps, order, 0)
    stiffness = np.take_along_axis(stiffness, order, 0)
    return running_sum(stiffness), running_sum(stiffness * gaps)


def closed_form(slopes: Array, intercepts: Array, y: Coordinates, c: Coordinates) -> Coordinates:
    """The force F = phi(y - c F) of a bed with this law: exact, without iteration, and never
    negative.

    F = max(0, max_s (K_s y - B_s) / (1 + c K_s)), in closed form:
    along each line of phi the equation is linear, and of the lines the largest answer holds.
    """
    force = slopes * y[0]
    force -= intercepts
    force /= slopes * c[0] + 1.0
    return (np.maximum(force.max(axis=0), 0.0),)


def spring_loads(depths: Array, gaps: Array, stiffness: Array, weight: Array) -> Array:
    """(L, C, n) load of each spring at the lines' depths (L, n), before sharing out."""
    inside = depths[:, None] - gaps
    np.maximum(inside, 0.0, out=inside)
    inside *= weight[:, None] * stiffness
    return inside


def share_out(force: Array, loads: Array) -> Array:
    """The force (n,) shared among springs as their loads (L, C, n) stand to each other (in
    place).

    Not the loads themselves: at a stiffness of 1e15 N/m they lose digits that the force has.
    """
    whole = total(total(loads))
    loads *= force / np.where(whole > 0.0, whole, 1.0)
    return loads
