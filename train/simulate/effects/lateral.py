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

import math
from typing import Any

import numpy as np
from numba import njit

from train.simulate import base, base_steps
from train.simulate.compiled import Array, integers, matrix, vector
from train.simulate.contact import share_out
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

MARGIN = 0.19
"""What the flat strip bears beyond the foundation under it, as a width over H."""
SPREAD = 0.55
"""The same of the load at first touch, which goes with a^2 as on a half space."""

ROOM = ("borne", "wide", "ellipse", "askew")
LATERAL = Part("lateral", "depth_m", "nearest", *integers(*ROOM))
"""The layer's thickness and the depth at which its first column is touched, in metres; room for
four numbers a row."""
lateral_of = LATERAL.of


def add(build: Build) -> None:
    """Let the columns feel each other."""
    build.put("setup", base.WINDOW + 5, narrow)
    build.put("setup", base.BED + 3, margin)
    build.replace(base_steps.image, image)


def delay(x: Array, depth: Array) -> Array:
    """How many times metres deeper than on independent springs the layer is touched at x, times
    R: the integral of a (SPREAD - MARGIN) H / (a + MARGIN H)."""
    beside = MARGIN * depth
    return np.asarray((SPREAD - MARGIN) * depth * (x - beside * np.log1p(x / beside)))


def touched_at(gaps: Array, radius: Array | float, depth: Array) -> Array:
    """The depths at which columns are touched that lie `gaps` R (1 - cos theta) back."""
    # From the cylinder's own gap its x = R sin theta.
    near = np.minimum(gaps, radius)
    return gaps + delay(np.sqrt(near * (2.0 * radius - near)), depth) / radius


def narrow(state: State) -> None:
    """Columns are touched later."""
    depth = state.values["depth_m"]
    state.column_gaps = touched_at(state.column_gaps, state.skin.radius_m, depth)
    none = np.zeros((state.skin.rows, state.n))
    state.begin(
        LATERAL,
        depth_m=depth,
        nearest=state.column_gaps.min(axis=0),
        **{name: state.lend(f"lateral_{name}", none) for name in ROOM},
    )


def margin(state: State) -> None:
    """A spring more in the middle, touched first, for the foam beside the contact."""
    bed = state.bed
    middle = len(bed.gaps) // 2
    width = 2.0 * MARGIN * state.values["depth_m"] / state.skin.column_pitch_m
    more = state.taxel_k * width * bed.stiffness.max(axis=0).astype(bool)
    bed.gaps = np.insert(bed.gaps, middle, 0.0, axis=0)
    bed.stiffness = np.insert(bed.stiffness, middle, more, axis=0)


@njit(error_model="numpy")
def askew_at(depth: Array, weight: Array, row: int, pitch_m: float) -> float:
    """How steeply the forearm dips into the face's ends in a row, as far as these lie there.

    A face that covers the skin's first or last row whole goes on beyond the skin.
    """
    last, askew = len(depth) - 1, 0.0
    if row < last:
        before = weight[row - 1] if row > 0 else math.floor(weight[0])
        falls = max(-(depth[row + 1] - depth[row]) / pitch_m, 0.0)
        askew += max(weight[row] - before, 0.0) * falls
    if row > 0:
        after = weight[row + 1] if row < last else math.floor(weight[last])
        rises = max((depth[row] - depth[row - 1]) / pitch_m, 0.0)
        askew += max(weight[row] - after, 0.0) * rises
    return askew


@njit(error_model="numpy")
def share_rows(t: Any, borne: Array, wide: Array) -> None:
    """What each row bears, up to a factor, `wide` columns (rows,) of it: into `borne` (rows,).

    Across the forearm a row bears as a layer does; along it the rows feel each other as a
    stretched foundation does whose length is the margin (Pasternak's; Kerr, J. Applied Mechanics
    31, 1964). Where the forearm lies askew over the end of a face, that end bears the margin
    squared times the slope more, and rows pressed less deep than the margin times the slope are
    hardly touched. Against an elastic block by finite elements, askew by 10 and 17 degrees, the
    highest load of a taxel is within 10 %.
    """
    depth, weight = vector(t.line_depth, t.rows), vector(t.weight, t.rows)
    gaps, stiffness = vector(t.gaps, t.springs), vector(t.stiffness, t.springs)
    own, all_askew = lateral_of(t), 0.0
    margin, askew = MARGIN * own.depth_m, vector(own.askew, t.rows)
    for row in range(t.rows):
        whole = 0.0
        for s in range(t.springs if depth[row] > 0.0 else 0):
            inside = depth[row] - gaps[s]
            if inside > 0.0:
                whole += inside * stiffness[s]
        borne[row] = whole * weight[row]
        askew[row] = askew_at(depth, weight, row, t.row_pitch_m)
        all_askew += askew[row]
    least = margin * all_askew
    if not least > 0.0:
        return
    edge = t.taxel_k * margin * margin / t.row_pitch_m
    for row in range(t.rows):
        touched = min(max(depth[row] / least - 0.5, 0.0), 1.0)
        borne[row] = borne[row] * touched + edge * askew[row] * wide[row]


@compiled
def image(t: Any) -> None:
    """The force shared out among the rows as each bears, and within a row as a half ellipse: as
    the root of each column's depth past its touch."""
    own = lateral_of(t)
    depth, gaps = vector(t.line_depth, t.rows), vector(t.column_gaps, t.columns)
    loads, reach = matrix(t.image, t.rows, t.columns), vector(t.reach, t.columns)
    borne, wide = vector(own.borne, t.rows), vector(own.wide, t.rows)
    ellipse = vector(own.ellipse, t.rows)
    for row in range(t.rows):
        wide[row] = ellipse[row] = 0.0
        loads[row, :] = 0.0
        for column in range(t.columns if depth[row] > 0.0 else 0):
            # A touch so slight that it falls between the columns is the nearest one's.
            inside = depth[row] - (gaps[column] - own.nearest)
            if inside > 0.0:
                loads[row, column] = math.sqrt(inside) * reach[column]
                wide[row] += reach[column]
                ellipse[row] += loads[row, column]
    share_rows(t, borne, wide)
    for row in range(t.rows):
        part = borne[row] / (ellipse[row] if ellipse[row] > 0.0 else 1.0)
        for column in range(t.columns):
            loads[row, column] *= part
    share_out(t.force, loads)
