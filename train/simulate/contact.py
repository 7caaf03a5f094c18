"""The bed of springs between skin and object: its law, and a step that is always
stable.

A bed is lines (rows of the skin, or stems) of springs (columns around the forearm). At
depth d a line bears sum_s k_s max(0, d - line_gap - gap_s) times its weight. In the
depth a of the whole bed this is convex and piecewise linear, phi(a) = max_s(K_s a -
B_s), so an implicit step has a closed form (`closed_form`).

The coordinates of a contact are y = (a, tilt), its loads are a force and a moment (F,
M), and C = (c00, c01, c11) is the motion of y within the step for unit loads. A forearm
that does not pivot has neither tilt nor moment.
"""

import numpy as np

from train.simulate.arm import Array, Places

GRAVITY = 9.80665


def covered(offset: Array, width: Array, pitch: float) -> Array:
    """The part of a taxel that a face covers, from 0 to 1.

    Args:
        offset: metres from the face's middle to the taxel's.
        width: metres of the face; no face is narrower than a taxel.
        pitch: metres of the taxel.
    """
    half = 0.5 * np.maximum(width, pitch)
    inside = (half + 0.5 * pitch - np.abs(offset)) / pitch
    return np.minimum(np.maximum(inside, 0.0), 1.0)


def curve_gap(offset: Array, radius: Array) -> Array:
    """Gap of a face curved along the forearm: l^2 / (2 r)."""
    return offset * offset / (2.0 * radius)


def total(values: Array) -> Array:
    """The sum over the first axis, one term after the other: the same bits in any
    batch.

    `np.add.reduce` adds so too, unless the batch is one wide: then it adds in pairs.
    """
    if values.shape[-1] > 1:
        return np.asarray(np.add.reduce(values, axis=0))
    return np.asarray(np.add.accumulate(values, axis=0)[-1])


def by_depth(gaps: Array, stiffness: Array) -> tuple[Places, Array, Array]:
    """Order, gaps and stiffness, (S, n) each, of springs sorted by their gaps."""
    order = gaps.argsort(axis=0, kind="stable")
    return (
        order,
        np.take_along_axis(gaps, order, 0),
        np.take_along_axis(stiffness, order, 0),
    )


def bed_law(gaps: Array, stiffness: Array) -> tuple[Array, Array]:
    """Slopes K and intercepts B, (S, n) each, of springs (S, n) in the order of their
    gaps."""
    weighted = np.where(stiffness > 0.0, gaps, 0.0) * stiffness
    return np.add.accumulate(stiffness, axis=0), np.add.accumulate(weighted, axis=0)


def closed_form(
    gaps: Array,
    slopes: Array,
    intercepts: Array,
    y: Array,
    c: Array,
) -> Array:
    """The forces F = phi(y - c F) of beds (S, n): exact, without iteration, and never
    negative.

    F = max(0, max_s (K_s y - B_s) / (1 + c K_s)): along each line of phi the equation
    is linear, and the largest of the lines' answers holds. A spring that y itself does
    not reach adds nothing.

    Args:
        y: (n,) depths of the beds without load.
        c: (n,) metres that they give way for each newton.
    """
    reached = gaps < y
    reached[0] = True
    deep = int(np.flatnonzero(reached.any(axis=1))[-1]) + 1
    lines = (slopes[:deep] * y - intercepts[:deep]) / (slopes[:deep] * c + 1.0)
    return np.asarray(np.where(reached[:deep], lines, 0.0).max(axis=0, initial=0.0))


def spring_loads(depths: Array, gaps: Array, stiffness: Array, weight: Array) -> Array:
    """(S, L, n) load of each spring (S, n) at the lines' depths (L, n), before sharing
    out."""
    return np.maximum(depths - gaps[:, None], 0.0) * (weight * stiffness[:, None])


def share_out(force: Array, loads: Array) -> None:
    """Share forces (n,) among springs in proportion to their loads (S, L, n), in place.

    At a stiffness of 1e15 N/m the loads have fewer digits than the force, so they give
    only proportions.
    """
    borne = total(total(loads.swapaxes(0, 1)))
    loads *= force / np.where(borne > 0.0, borne, 1.0)
