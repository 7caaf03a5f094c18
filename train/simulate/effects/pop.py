"""Bubble wrap: a bubble under each taxel stiffens by the gas law and is gone once it bursts.

p = p0 V0 / (V0 - A d) gives f = k0 d / (1 - d/b) for a bubble of height b; three of its
tangents (at 0, b/2 and 3b/4) stand for it, and each joins the skin's spring in series exactly.
A burst bubble leaves the hard backing, b further on.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from train.simulate import base
from train.simulate.contact import (
    Array,
    Springs,
    bed_law,
    share_out,
    spring_loads,
    total,
)
from train.simulate.plan import Build
from train.simulate.state import Bed, State

SLOPES = (1.0, 4.0, 16.0)
"""Slopes of the tangents, as multiples of k0."""
BREAKS = (1.0 / 3.0, 2.0 / 3.0)
"""Depths at which they cross, as multiples of b."""
SEGMENTS = len(SLOPES) + 1


@dataclass
class BubbleBed(Bed):
    """A bed of which some springs are gone: those of burst bubbles.

    Attributes:
        alive: (rows, SEGMENTS * C, n) 1 where a spring bears, 0 where it is gone or still to come.
        order: of all rows' springs by their gaps, where the law asks for it.
    """

    alive: Array
    order: NDArray[np.intp] = field(init=False)

    def lines_of(self, springs: Springs, lever: Array) -> Springs:
        """The bed's springs, without those that are gone."""
        return super().lines_of(springs, lever)._replace(alive=self.alive)


def bubbles(state: State) -> BubbleBed:
    """The bed, which is one of bubbles here."""
    assert isinstance(state.bed, BubbleBed)
    return state.bed


def add(build: Build) -> None:
    """Bubbles between skin and backing."""
    build.put("setup", base.BED + 5, inflate)
    build.replace(base.order_bed, order)
    build.replace(base.image, image)
    # A pivoting forearm's solver asks the lines themselves.
    build.put("sample", base.IMAGE + 20, burst if "tilt" in build.effects else burst_in_order)


def inflate(state: State) -> None:
    """Each column becomes four springs: three tangents, and the backing for after the burst."""
    values, skin = state.values, state.taxel_k
    k0, height = values["bubble_n_m"], values["bubble_m"]
    slopes = [1.0 / (1.0 / skin + 1.0 / (k0 * s)) for s in SLOPES]
    first = k0 * height * BREAKS[0] / slopes[0]
    second = first + k0 * SLOPES[1] * height * (BREAKS[1] - BREAKS[0]) / slopes[1]
    gaps, reach = state.column_gaps, state.reach
    rows, (columns, n) = len(state.bed.weight), gaps.shape
    alive = np.zeros((rows, SEGMENTS, columns, n))
    alive[:, :-1] = 1.0
    state.bed = BubbleBed(
        gaps=np.concatenate([gaps, gaps + first, gaps + second, gaps + height]),
        stiffness=np.concatenate(
            [
                reach * slopes[0],
                reach * (slopes[1] - slopes[0]),
                reach * (slopes[2] - slopes[1]),
                reach * skin,
            ]
        ),
        weight=state.bed.weight,
        line_gap=state.bed.line_gap,
        alive=alive.reshape(rows, SEGMENTS * columns, n),
    )


def order(state: State) -> None:
    """The bed's law as lines K a - B, over the bubbles that are whole."""
    bed = bubbles(state)
    bed.order = np.argsort(all_gaps(bed), axis=0, kind="stable")
    law(state)


def all_gaps(bed: BubbleBed) -> Array:
    """(E, n) of every row's springs."""
    gaps = bed.line_gap[:, None] + np.broadcast_to(bed.gaps, bed.alive.shape)
    return gaps.reshape(-1, gaps.shape[-1])


def law(state: State) -> None:
    """The law of the springs that are there."""
    bed = bubbles(state)
    stiffness = bed.weight[:, None] * (bed.stiffness[None] * bed.alive)
    bed.slopes, bed.intercepts = bed_law(all_gaps(bed), stiffness.reshape(-1, state.n), bed.order)


def image(state: State) -> None:
    """The force shared out among springs, then the four springs of each taxel together."""
    bed = bubbles(state)
    rows, n = bed.weight.shape
    depth = np.broadcast_to(state.line_depth, (rows, n))
    loads = spring_loads(depth, bed.gaps, bed.stiffness, bed.weight)
    loads *= bed.alive
    shared = share_out(state.force, loads).reshape(rows, SEGMENTS, -1, n)
    state.image = total(np.moveaxis(shared, 1, 0))


def burst(state: State) -> None:
    """Bubbles under more than they hold are gone from the next frame on."""
    gone = state.image > state.values["pop_n"]
    if gone.any():
        take_away(bubbles(state), gone)


def burst_in_order(state: State) -> None:
    """The same, and the law without them."""
    gone = state.image > state.values["pop_n"]
    if gone.any():
        take_away(bubbles(state), gone)
        law(state)


def take_away(bed: BubbleBed, gone: NDArray[np.bool_]) -> None:
    """Leave the backing where bubbles (rows, columns, n) are gone."""
    rows, _, n = bed.alive.shape
    bed.alive = np.copy(bed.alive)
    alive = bed.alive.reshape(rows, SEGMENTS, -1, n)
    alive[:, :-1] *= ~gone[:, None]
    alive[:, -1] = np.maximum(alive[:, -1], gone)
