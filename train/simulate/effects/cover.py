"""A sleeve over the skin: a spring in series, 1/k = 1/k_skin + 1/k_cover, that spreads load."""

from __future__ import annotations

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
    seen = state.image
    moved = seen * state.values["cover_spread"]
    image = seen - 4.0 * moved
    image[:, :-1] += moved[:, 1:]
    image[:, 1:] += moved[:, :-1]
    image[1:] += moved[:-1]
    image[:-1] += moved[1:]
    for end in (0, -1):
        image[end] += moved[end]
    for end in (0, -1):
        image[:, end] += moved[:, end]
    state.image = image
