"""Foam that is pressed flat: its cells close, and what is behind it is felt.

An open-celled foam is about linear to two thirds of its thickness (the support factor of the IFD
test, 65 % over 25 % of compression, is 2 to 2.6; a linear one has 2.6), then stiffens, and is
solid at 1 - 1.4 times its relative density (Gibson and Ashby, Cellular Solids, 5.2), some 93 %.
Two tangents more a column stand for that, so that the bed stays convex and piecewise linear.
"""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.plan import Build
from train.simulate.state import State

CLOSING, CLOSED = 0.65, 0.93
"""Parts of the thickness at which the cells begin to close, and are closed."""
STIFFER = 5.0
"""Times its first stiffness between them."""


def add(build: Build) -> None:
    """Let the foam end."""
    build.put("setup", base.BED + 8, close)


def close(state: State) -> None:
    """Each column's tangents: the closing cells, then what is behind."""
    bed, depth = state.bed, state.values["depth_m"]
    hard = state.reach * state.values["taxel_n_m"]
    gaps, soft = state.column_gaps, state.reach * state.taxel_k
    bed.gaps = np.concatenate([bed.gaps, gaps + CLOSING * depth, gaps + CLOSED * depth])
    bed.stiffness = np.concatenate([bed.stiffness, soft * (STIFFER - 1.0), hard])
