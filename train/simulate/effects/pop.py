"""Bubble wrap: a bubble under each taxel stiffens by the gas law and is gone once it bursts.

p = p0 V0 / (V0 - A d) gives f = k0 d / (1 - d/b) for a bubble of height b; three of its
tangents (at 0, b/2 and 3b/4) stand for it, and each joins the skin's spring in series exactly.
A burst bubble leaves the hard backing, b further on.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from train.simulate import base, base_steps
from train.simulate.base_steps import bed_loads, lay_law
from train.simulate.compiled import indices, integers, matrix, vector
from train.simulate.contact import share_out
from train.simulate.plan import Build
from train.simulate.state import Bed, State
from train.simulate.trial import Part, compiled

SLOPES = (1.0, 4.0, 16.0)
"""Slopes of the tangents, as multiples of k0."""
BREAKS = (1.0 / 3.0, 2.0 / 3.0)
"""Depths at which they cross, as multiples of b."""
SEGMENTS = len(SLOPES) + 1

POP = Part("pop", "pop_n", *integers("order", "bears", "loads"))
"""The newtons that burst a bubble; of all rows' springs: which is the first, second and so on by
its gap, if that is asked for, and room for two numbers."""
pop_of = POP.of


def add(build: Build) -> None:
    """Bubbles between skin and backing."""
    build.put("setup", base.BED + 5, inflate)
    build.put("setup", base.BED + 6, begin)
    if "tilt" not in build.effects:
        build.replace(base.order_bed, order)
    build.replace(base_steps.image, image)
    build.put("sample", base.IMAGE + 20, burst)


def inflate(state: State) -> None:
    """Each column becomes four springs: three tangents, and the backing for after the burst."""
    values, skin = state.values, state.taxel_k
    k0, height = values["bubble_n_m"], values["bubble_m"]
    slopes = [1.0 / (1.0 / skin + 1.0 / (k0 * s)) for s in SLOPES]
    first = k0 * height * BREAKS[0] / slopes[0]
    second = first + k0 * SLOPES[1] * height * (BREAKS[1] - BREAKS[0]) / slopes[1]
    gaps, reach = state.column_gaps, state.reach
    state.bed = Bed(
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
    )


def begin(state: State) -> None:
    """Every bubble is whole."""
    springs, n = state.bed.gaps.shape
    alive = np.ones((len(state.bed.weight), springs, n))
    alive[:, springs // SEGMENTS * (SEGMENTS - 1) :] = 0.0
    state.records["alive"] = state.lend("alive", alive)
    loads = state.lend("pop_loads", alive)
    state.begin(POP, pop_n=state.values["pop_n"], loads=loads)


def order(state: State) -> None:
    """The bed's law, and room for what it becomes as bubbles burst."""
    bed, own = state.bed, state.of(POP)
    alive = np.moveaxis(state.arrays["alive"], 0, -1)
    gaps = (bed.line_gap[:, None] + np.broadcast_to(bed.gaps, alive.shape)).reshape(-1, state.n)
    stiffness = bed.weight[:, None] * (bed.stiffness[None] * alive)
    own.order = state.lend("pop_order", state.obey(gaps, stiffness.reshape(-1, state.n)))
    own.bears = state.lend("pop_bears", np.zeros_like(gaps))


@njit(error_model="numpy")
def law(t: Any) -> None:
    """The law of the springs that are there; a pivoting forearm's solver asks the rows instead."""
    own = pop_of(t)
    if own.order == 0:
        return
    weight, stiffness = vector(t.weight, t.rows), vector(t.stiffness, t.springs)
    alive, order = matrix(t.alive, t.rows, t.springs), indices(own.order, t.law_lines)
    bears = vector(own.bears, t.law_lines)
    for e in range(t.law_lines):
        row, spring = order[e] // t.springs, order[e] % t.springs
        bears[e] = weight[row] * (stiffness[spring] * alive[row, spring])
    lay_law(t, own.bears, t.slopes, t.intercepts)


@compiled
def image(t: Any) -> None:
    """The force shared out among springs, then the four springs of each taxel together."""
    own = pop_of(t)
    loads, alive = matrix(own.loads, t.rows, t.springs), matrix(t.alive, t.rows, t.springs)
    seen = matrix(t.image, t.rows, t.columns)
    bed_loads(t, t.springs, loads)
    for row in range(t.rows):
        for s in range(t.springs):
            loads[row, s] *= alive[row, s]
    share_out(t.force, loads)
    for row in range(t.rows):
        for column in range(t.columns):
            whole = 0.0
            for s in range(column, t.springs, t.columns):
                whole += loads[row, s]
            seen[row, column] = whole


@compiled
def burst(t: Any) -> None:
    """Bubbles under more than they hold are gone from the next frame on, and leave the backing."""
    own, seen = pop_of(t), matrix(t.image, t.rows, t.columns)
    alive, gone = matrix(t.alive, t.rows, t.springs), False
    for row in range(t.rows):
        for column in range(t.columns):
            if seen[row, column] > own.pop_n:
                gone = True
                backing = t.springs - t.columns + column
                for s in range(column, backing, t.columns):
                    alive[row, s] = 0.0
                alive[row, backing] = 1.0
    if gone:
        law(t)
