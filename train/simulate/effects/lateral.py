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
from train.simulate.contact import Array, share_out, touching
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
    """The force shared out among taxels as a half ellipse: as the root of each column's depth
    past its touch."""
    bed = state.bed
    depth = np.broadcast_to(state.line_depth, bed.weight.shape)
    held = np.where(state.force > 0.0, depth.max(axis=0), -np.inf)
    gaps = state.column_gaps
    nearest = gaps.min(axis=0)
    # A touch so slight that it falls between the columns is the nearest one's.
    some = touching(gaps - nearest, held)
    inside = np.maximum(depth[:, None] - (gaps - nearest)[some], 0.0)
    loads = np.sqrt(inside) * (bed.weight[:, None] * state.reach[some])
    state.image = share_out(state.force, loads)
    state.image_from = some.start
