"""Foam as an elastic layer, whose surface moves beside the contact too, not as separate
springs.

For a smooth body pressed into a layer of thickness H, the load grows with depth as the
stiffness of a flat strip as wide as the contact: dF/dd = S(a) (a the contact's half
width; Barber, Contact Mechanics, 4.4: the incompressible argument holds for any linear
elastic body). Solved numerically for a bonded layer (plane strain, no lateral strain in
uniaxial compression) both S and F are a foundation's with a margin beside the contact,

    S(a) = 2 E (a / H + 0.19) a metre of length, F(a) = (E / R) (2/3 a^3 / H + 0.55
    a^2),

so a column of taxels at x is touched at the depth at which the contact has become that
wide,

    d(x) = (1 / R) integral of a (a + 0.55 H) / (a + 0.19 H) from 0 to x,

and from then on adds its foundation. The margin is one more spring in each line. The
bed stays convex and piecewise linear. The pressure is close to a half ellipse at any a
/ H up to 1.5.
"""

import numpy as np

from train.simulate.contact import share_out, total
from train.simulate.trials import Array, Trials

MARGIN = 0.19
"""Load of the flat strip beyond the foundation under it, as a width over H."""
SPREAD = 0.55
"""The same for the load at first touch, which grows with a^2 as on a half space."""


def delay(x: Array, depth: Array) -> Array:
    """R times the depth at which the layer is touched at x, beyond that of separate
    springs: the integral of a (SPREAD - MARGIN) H / (a + MARGIN H)."""
    beside = MARGIN * depth
    return np.asarray((SPREAD - MARGIN) * depth * (x - beside * np.log1p(x / beside)))


def touched_at(gaps: Array, radius: Array | float, depth: Array) -> Array:
    """The depths at which columns are touched whose gaps are R (1 - cos theta)."""
    # The cylinder's gap gives x = R sin theta.
    depths = np.minimum(gaps, radius)
    return gaps + delay(np.sqrt(depths * (2.0 * radius - depths)), depth) / radius


def widen(t: Trials) -> None:
    """Columns are touched at a larger depth."""
    t.bed.column_gaps = touched_at(
        t.bed.column_gaps,
        t.scene.skin.radius_m,
        t.values["depth_m"],
    )


def fill(t: Trials) -> None:
    """Add one spring to each row, touched first, for the foam beside the contact."""
    width = 2.0 * MARGIN * t.values["depth_m"] / t.scene.skin.pitch[1]
    beside = t.bed.taxel_k * width * t.bed.reach.any(axis=0)
    t.add_springs(np.zeros((1, len(t))), beside[None])


def askew(depth: Array, weight: Array, pitch_m: float) -> Array:
    """(rows, n) slope with which the forearm dips into an end of the face that lies in
    this row.

    A face that covers all of the skin's first or last row continues beyond the skin.
    """
    rises = np.diff(depth, axis=0) / pitch_m
    before = np.concatenate([np.floor(weight[:1]), weight[:-1]])
    after = np.concatenate([weight[1:], np.floor(weight[-1:])])
    out = np.zeros_like(depth)
    out[:-1] += np.maximum(weight - before, 0.0)[:-1] * np.maximum(-rises, 0.0)
    out[1:] += np.maximum(weight - after, 0.0)[1:] * np.maximum(rises, 0.0)
    return out


def row_loads(t: Trials, wide: Array) -> Array:
    """(rows, n) the load of each row up to a common factor, with `wide` (rows, n)
    columns touched.

    Across the forearm a row bears the load of a layer. Along it, rows are coupled as in
    a stretched foundation whose length is the margin (Pasternak's; Kerr, J. Applied
    Mechanics 31, 1964). Where the forearm lies askew over the end of a face, that end
    bears the margin squared times the slope in addition, and rows pressed less deep
    than the margin times the slope are hardly touched. The highest load of a taxel is
    within 10 % of that on an elastic block by finite elements, askew by 10 and 17
    degrees.
    """
    depth = t.touch.line_depth
    weight = t.bed.weight
    gaps = t.bed.gaps
    stiffness = t.bed.stiffness
    touched = (gaps < depth.max(axis=0)).any(axis=1)
    inside = np.maximum(depth - gaps[touched][:, None], 0.0)
    pressed = total(inside * stiffness[touched][:, None]) if touched.any() else 0.0
    borne = np.where(depth > 0.0, pressed, 0.0) * weight
    margin = MARGIN * t.values["depth_m"]
    pitch = t.scene.skin.pitch[0]
    ends = askew(depth, weight, pitch)
    slight = margin * total(ends)
    dips = slight > 0.0
    if dips.any():
        edge = t.bed.taxel_k * margin * margin / pitch
        part = np.clip(depth / np.where(dips, slight, 1.0) - 0.5, 0.0, 1.0)
        borne = np.where(dips, borne * part + edge * ends * wide, borne)
    return np.asarray(borne)


def image(t: Trials) -> None:
    """Share the force among the rows by their loads, and within a row as a half
    ellipse: by the root of each column's depth beyond its touch."""
    depth = t.touch.line_depth
    reach = t.bed.reach
    # A touch so slight that it falls between two columns goes to the nearest.
    gaps = t.bed.column_gaps
    gaps = gaps - gaps.min(axis=0)
    inside = np.where(depth > 0.0, depth - gaps[:, None], 0.0)
    touched = inside > 0.0
    loads = np.sqrt(np.where(touched, inside, 0.0)) * reach[:, None]
    borne = row_loads(t, total(touched * reach[:, None]))
    ellipse = total(loads)
    loads *= borne / np.where(ellipse > 0.0, ellipse, 1.0)
    share_out(t.touch.force, loads)
    t.touch.image = loads.swapaxes(0, 1)
