"""A sleeve over the skin: a spring in series, 1/k = 1/k_skin + 1/k_cover, that spreads load."""

from __future__ import annotations

import numpy as np

from train.simulate import base
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Put the sleeve on."""
    build.put("setup", base.SPRINGS + 8, soften)
    build.put("sample", base.IMAGE + 10, spread)


def soften(state: State) -> None:
    """The sleeve in series with what is there."""
    state.taxel_k = 1.0 / (1.0 / state.taxel_k + 1.0 / state.values["cover_n_m"])


def spread(state: State) -> None:
    """Each neighbour takes its part of a taxel's load; none is lost at the skin's ends."""
    part, seen = state.values["cover_spread"], state.image
    if not seen.shape[1]:
        return
    rows = state.skin.rows
    image = np.zeros_like(seen, shape=(rows, *seen.shape[1:]))
    image[state.bed.lines] = seen
    state.bed.lines = slice(0, rows)
    first, last = state.image_from - 1, state.image_from + image.shape[1]
    window = len(state.columns)
    moved = image * part
    wide = np.zeros_like(seen, shape=(rows, image.shape[1] + 2, image.shape[2]))
    wide[:, 1:-1] = image - 4.0 * moved
    wide[:, :-2] += moved
    wide[:, 2:] += moved
    wide[1:, 1:-1] += moved[:-1]
    wide[:-1, 1:-1] += moved[1:]
    wide[0, 1:-1] += moved[0]
    wide[-1, 1:-1] += moved[-1]
    if first < 0:
        wide[:, 1] += wide[:, 0]
        wide, first = wide[:, 1:], 0
    if last >= window:
        wide[:, -2] += wide[:, -1]
        wide = wide[:, :-1]
    state.image, state.image_from = wide, first
