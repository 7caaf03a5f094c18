"""Foam that pulls its neighbourhood along: an elastic layer in place of independent springs.

For a smooth body pressed into a layer of thickness H, the load grows with depth as the stiffness
of a flat strip as wide as the contact: dF/dd = S(a) (a the contact's half width; Barber, Contact
Mechanics, 4.4: the incompressible argument holds for any linear elastic body). Solved numerically
for a bonded layer (plane strain, no lateral strain in uniaxial compression) both S and F are a
foundation's with a margin beside the contact,

    S(a) = 2 E (a / H + 0.19) a metre of length,   F(a) = (E / R) (2/3 a^3 / H + 0.55 a^2),

so a column of taxels at x is touched at the depth at which the contact has become that wide,

    d(x) = (1 / R) integral of a (a + 0.55 H) / (a + 0.19 H) from 0 to x,

and from then on adds its foundation; the margin is a spring more a line. The bed stays convex
and piecewise linear. The pressure is close to a half ellipse at any a / H up to 1.5.
"""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.contact import Array, share_out, total
from train.simulate.plan import Build
from train.simulate.state import State

MARGIN = 0.19
"""What the flat strip bears beyond the foundation under it, as a width over H."""
SPREAD = 0.55
"""The same of the load at first touch, which goes with a^2 as on a half space."""


def add(build: Build) -> None:
    """Let the columns feel each other."""
    build.put("setup", base.WINDOW + 5, narrow)
    build.put("setup", base.BED + 3, margin)
    build.replace(base.image, image)


def delay(x: Array, depth: Array) -> Array:
    """How many times metres deeper than on independent springs the layer is touched at x, times
    R: the integral of a (SPREAD - MARGIN) H / (a + MARGIN H)."""
    beside = MARGIN * depth
    return np.asarray((SPREAD - MARGIN) * depth * (x - beside * np.log1p(x / beside)))


def narrow(state: State) -> None:
    """Columns are touched later."""
    radius, depth = state.skin.radius_m, state.values["depth_m"]
    # From the cylinder's own gap R (1 - cos theta) its x = R sin theta.
    gaps = np.minimum(state.column_gaps, radius)
    x = np.sqrt(gaps * (2.0 * radius - gaps))
    state.column_gaps = state.column_gaps + delay(x, depth) / radius


def margin(state: State) -> None:
    """A spring more in the middle, touched first, for the foam beside the contact."""
    bed = state.bed
    middle = len(bed.gaps) // 2
    width = 2.0 * MARGIN * state.values["depth_m"] / state.skin.column_pitch_m
    more = state.taxel_k * width * bed.stiffness.max(axis=0).astype(bool)
    bed.gaps = np.insert(bed.gaps, middle, 0.0, axis=0)
    bed.stiffness = np.insert(bed.stiffness, middle, more, axis=0)


def image(state: State) -> None:
    """The force shared out among the rows as each bears, and within a row as a half ellipse: as
    the root of each column's depth past its touch."""
    bed = state.bed
    depth = np.broadcast_to(state.line_depth, bed.weight.shape)
    # A touch so slight that it falls between the columns is the nearest one's.
    inside = np.maximum(depth[:, None] - (state.column_gaps - state.column_gaps.min(axis=0)), 0.0)
    loads = np.sqrt(inside) * state.reach
    ellipse = along_columns(loads)
    borne = row_loads(state, depth, along_columns((inside > 0.0) * state.reach))
    loads *= (borne / np.where(ellipse > 0.0, ellipse, 1.0))[:, None]
    state.image = share_out(state.force, loads)


def along_columns(values: Array) -> Array:
    """(L, n) the sums over the columns of (L, C, n), one term after the other."""
    return total(np.moveaxis(values, 1, 0))


def row_loads(state: State, depth: Array, wide: Array) -> Array:
    """(L, n) what each row bears, up to a factor, at the depths (L, n) and `wide` columns (L, n).

    Across the forearm a row bears as a layer does; along it the rows feel each other as a
    stretched foundation does whose length is the margin (Pasternak's; Kerr, J. Applied Mechanics
    31, 1964). Where the forearm lies askew over the end of a face, that end bears the margin
    squared times the slope more, and rows pressed less deep than the margin times the slope are
    hardly touched. Against an elastic block by finite elements, askew by 10 and 17 degrees, the
    highest load of a taxel is within 10 %.
    """
    bed = state.bed
    inside = np.maximum(depth[:, None] - bed.gaps, 0.0)
    borne = along_columns(inside * bed.stiffness) * bed.weight
    if len(state.line_depth) < 2:
        return borne
    margin, pitch = MARGIN * state.values["depth_m"], state.skin.row_pitch_m
    slope = (depth[1:] - depth[:-1]) / pitch
    ends = face_ends(bed.weight)
    askew = np.zeros_like(depth)
    askew[:-1] += ends[0][:-1] * np.maximum(-slope, 0.0)
    askew[1:] += ends[1][1:] * np.maximum(slope, 0.0)
    least = margin * total(askew)
    touched = np.clip(depth / np.where(least > 0.0, least, np.inf) - 0.5, 0.0, 1.0)
    edge = state.taxel_k * margin * margin / pitch * askew * wide
    loads: Array = borne * np.where(least > 0.0, touched, 1.0) + edge
    return loads


def face_ends(weight: Array) -> tuple[Array, Array]:
    """(L, n) twice: which part of the face's first end lies in each row, and of its last.

    Args:
        weight: (L, n) which part of each row the face covers; one that covers the skin's first or
            last row whole goes on beyond the skin.
    """
    first, last = np.copy(weight), np.copy(weight)
    first[1:] -= weight[:-1]
    last[:-1] -= weight[1:]
    first[0] -= np.floor(weight[0])
    last[-1] -= np.floor(weight[-1])
    return np.maximum(first, 0.0), np.maximum(last, 0.0)
