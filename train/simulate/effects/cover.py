"""A sleeve over the skin: a spring in series, 1/k = 1/k_skin + 1/k_cover, that spreads load."""

from __future__ import annotations

from typing import Any

import numpy as np

from train.simulate import base
from train.simulate.compiled import integers, matrix
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

COVER = Part("cover", "spread", *integers("moved"))
"""The part of a taxel's load that each neighbour takes, and room for an image."""
cover_of = COVER.of


def add(build: Build) -> None:
    """Put the sleeve on."""
    build.put("setup", base.SPRINGS + 8, soften)
    build.put("sample", base.IMAGE + 10, spread)


def soften(state: State) -> None:
    """The sleeve in series with what is there."""
    state.taxel_k = 1.0 / (1.0 / state.taxel_k + 1.0 / state.values["cover_n_m"])
    columns = 2 * base.beside(state.skin) + 1
    moved = state.lend("covered", np.zeros((state.skin.rows, columns, state.n)))
    state.begin(COVER, spread=state.values["cover_spread"], moved=moved)


@compiled
def spread(t: Any) -> None:
    """Each neighbour takes its part of a taxel's load; none is lost at the skin's ends."""
    own = cover_of(t)
    image, moved = matrix(t.image, t.rows, t.columns), matrix(own.moved, t.rows, t.columns)
    for row in range(t.rows):
        for column in range(t.columns):
            moved[row, column] = image[row, column] * own.spread
    last_row, last_column = t.rows - 1, t.columns - 1
    for row in range(t.rows):
        above, below = max(row - 1, 0), min(row + 1, last_row)
        for column in range(t.columns):
            left, right = max(column - 1, 0), min(column + 1, last_column)
            image[row, column] += (
                moved[row, right]
                + moved[row, left]
                + moved[above, column]
                + moved[below, column]
                - 4.0 * moved[row, column]
            )
