"""Foam that stiffens as it is pressed flat, until the surface behind it is felt.

An open-celled foam is about linear to two thirds of its thickness (the support factor
of the IFD test, 65 % over 25 % of compression, is 2 to 2.6; a linear one has 2.6), then
stiffens, and is solid at 1 - 1.4 times its relative density (Gibson and Ashby, Cellular
Solids, 5.2), some 93 %. Two more tangents for each column approximate this, so the bed
stays convex and piecewise linear.
"""

import numpy as np

from train.simulate.trials import Trials

CLOSING = 0.65
CLOSED = 0.93
"""Compression, as a part of the thickness, at which the cells begin to close and are
closed."""
STIFFER = 5.0
"""Stiffness between the two, as a multiple of the initial one."""


def fill(t: Trials) -> None:
    """Add each column's tangents: the closing cells, then the surface behind."""
    gaps = t.bed.column_gaps
    reach = t.bed.reach
    depth = t.values["depth_m"]
    closing = reach * t.bed.taxel_k * (STIFFER - 1.0)
    closed = reach * t.values["taxel_n_m"]
    t.add_springs(
        np.concatenate([gaps + CLOSING * depth, gaps + CLOSED * depth]),
        np.concatenate([closing, closed]),
    )
