"""The bed of springs between skin and object: its law, and the step that cannot blow up.

A bed is L lines (rows of the skin, or stems) of S springs (columns around the forearm). At
depth d a line bears sum_s k_s max(0, d - line_gap - gap_s) times its weight. As a function of
the depth a of the whole bed this is convex and piecewise linear, phi(a) = max_s(K_s a - B_s),
so an implicit step has a closed form (`closed_form`).

Coordinates of a contact are y = (a,), or (a, tilt) where the forearm pivots; loads are (F,),
or (F, M); C = (c00,) or (c00, c01, c11) is what a unit load takes off y within the step.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numba.extending import register_jitable
from numpy.typing import NDArray

from train.simulate.compiled import Array


@register_jitable
def covered(offset: Any, width: Any, pitch: Any) -> Any:
    """Which part of a taxel of this pitch is covered by a face of this width, from whose middle it
    lies `offset` away; no face is narrower than a taxel. All in metres, arrays or numbers."""
    half = 0.5 * np.maximum(width, pitch)
    inside = (half + 0.5 * pitch - np.abs(offset)) / pitch
    return np.minimum(np.maximum(inside, 0.0), 1.0)


@register_jitable
def curve_gap(offset: Any, radius: Any) -> Any:
    """How far a face curved along the forearm has drawn back: l^2 / (2 r)."""
    return offset * offset / (2.0 * radius)


def total(values: Array) -> Array:
    """The sum over the first axis, one term after the other: the same bits in any batch.

    `np.sum` adds so too, unless the batch is one wide: then it adds in pairs.
    """
    whole: Array = np.add.accumulate(values, axis=0)[-1]
    return whole


def by_depth(gaps: Array, stiffness: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Springs (E, n) in the order of their gaps: which each is, its gap and its stiffness."""
    order = gaps.argsort(axis=0, kind="stable")
    trials = np.arange(gaps.shape[1])
    return order, gaps[order, trials], stiffness[order, trials]


def sort_bed(gaps: Array, stiffness: Array) -> tuple[NDArray[np.intp], Array, Array, Array]:
    """The law of springs (E, n): which they are by their gaps, these in ascending order, slopes K
    and intercepts B of phi(a) = max(0, max_s(K_s a - B_s)), (E, n) each."""
    order, gaps, stiffness = by_depth(gaps, stiffness)
    return (
        order,
        gaps,
        np.add.accumulate(stiffness, axis=0),
        np.add.accumulate(stiffness * gaps, axis=0),
    )


@njit(error_model="numpy")
def add_up(gaps: Array, stiffness: Array, slopes: Array, intercepts: Array) -> None:
    """The law of one bed's springs (E,), which are in order."""
    slope, intercept = 0.0, 0.0
    for s in range(len(gaps)):
        slope += stiffness[s]
        intercept += stiffness[s] * gaps[s]
        slopes[s] = slope
        intercepts[s] = intercept


@njit(error_model="numpy")
def closed_form(gaps: Array, slopes: Array, intercepts: Array, y: float, c: float) -> float:
    """The force F = phi(y - c F) of a bed with this law (E,): exact, without iteration, and never
    negative.

    F = max(0, max_s (K_s y - B_s) / (1 + c K_s)), in closed form: along each line of phi the
    equation is linear, and of the lines the largest answer holds. A spring that y itself does not
    reach adds nothing.
    """
    force = 0.0
    for s in range(len(gaps)):
        if s > 0 and gaps[s] >= y:
            break
        force = max(force, (slopes[s] * y - intercepts[s]) / (slopes[s] * c + 1.0))
    return force


@njit(error_model="numpy")
def spring_loads(depths: Array, gaps: Array, stiffness: Array, weight: Array, out: Array) -> None:
    """(L, C) load of each spring at the lines' depths (L,), before sharing out."""
    for line in range(len(depths)):
        for c in range(len(gaps)):
            out[line, c] = max(depths[line] - gaps[c], 0.0) * (weight[line] * stiffness[c])


@njit(error_model="numpy")
def share_out(force: float, loads: Array) -> None:
    """The force shared among springs as their loads (L, C) stand to each other (in place).

    Not the loads themselves: at a stiffness of 1e15 N/m they lose digits that the force has.
    """
    whole = 0.0
    for c in range(loads.shape[1]):
        column = 0.0
        for line in range(len(loads)):
            column += loads[line, c]
        whole += column
    part = force / (whole if whole > 0.0 else 1.0)
    for line in range(len(loads)):
        for c in range(loads.shape[1]):
            loads[line, c] *= part
