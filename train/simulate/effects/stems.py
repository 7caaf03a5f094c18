"""Foliage: stems that stand at different depths, bend as cantilevers (k = 3 E I / L^3, one
number here), damp, and slip off the forearm once bent too far, for good."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from train.simulate import base, base_steps, streams
from train.simulate.base_steps import lay_law
from train.simulate.compiled import indices, integers, vector
from train.simulate.plan import Build
from train.simulate.state import Bed, State
from train.simulate.trial import Part, compiled

STEMS = Part(
    "stems",
    *("slip_m", "drag"),
    *integers("taxel", "following", "part", "order", "damping"),
    *integers("slopes", "intercepts", "sorted", "loads"),
)
"""The bend in metres at which a stem slips off; N s/m of all that bend; of each stem: the positions
in the window's image of the two rows it lies between, and the part of its load that the second
bears; which stem is the first, second and so on by depth; N s/m, 0 once it has slipped off; the law
of those still held, without damping; room for two numbers."""
stems_of = STEMS.of


def add(build: Build) -> None:
    """Stems in place of the bed's rows."""
    build.replace(base.lay_bed, plant)
    build.replace(base.order_bed, stand)
    build.replace(base_steps.image, draw)
    build.put("tune", base.ORDER, damp)
    build.put("step", base.SETTLE + 10, bend)


def plant(state: State) -> None:
    """Where the stems stand: (stems, n) depths, rows, columns and stiffnesses."""
    values = state.values
    counts = values["stem_count"].astype(np.int64)
    n, rows = state.n, state.skin.rows
    shape = (int(counts.max()), n)
    # Where a plant has fewer stems than its neighbours in the batch, the others weigh nothing.
    depth, along, around, stiffness = np.ones(shape), *(np.zeros(shape) for _ in range(3))
    for i, (trial, count) in enumerate(zip(state.trials, counts, strict=True)):
        generator = streams.stream(state.scene.seed, "stems", trial.key, trial.number)
        depth[:count, i] = generator.random(count)
        along[:count, i] = generator.random(count)
        around[:count, i] = generator.integers(-1, 2, count)
        stiffness[:count, i] = np.exp(0.3 * generator.standard_normal(count))
    depth -= depth.min(axis=0)
    state.bed = Bed(
        gaps=np.zeros((1, n)),
        stiffness=values["stem_n_m"][None],
        weight=stiffness,
        line_gap=depth * values["stem_spread_m"],
    )
    half = 0.5 * np.minimum(values["width_m"], rows * state.skin.row_pitch_m)
    middle = (state.row_z[0] - state.z) / state.skin.row_pitch_m
    reach = half / state.skin.row_pitch_m
    row = np.clip(middle + (2.0 * along - 1.0) * reach, 0.0, max(rows - 1.001, 0.0))
    window = state.columns.shape[0]
    column = (window // 2 + around).astype(np.int64)
    low = np.floor(row).astype(np.int64)
    taxel = low * window + column
    beside = window if rows > 1 else 0
    state.begin(
        STEMS,
        taxel=state.lend("stem_taxel", taxel),
        following=state.lend("stem_following", taxel + beside),
        part=state.lend("stem_part", row - low),
    )


def stand(state: State) -> None:
    """The stems by depth, and what each damps: 2 zeta sqrt(k m)."""
    values, bed, own = state.values, state.bed, state.of(STEMS)
    stiffness = bed.weight * bed.stiffness
    damping = (2.0 * values["stem_damping"] * np.sqrt(stiffness * values["stem_kg"])) * (
        bed.weight > 0.0
    )
    own.slip_m = values["stem_slip_m"]
    own.order = state.lend("stem_order", state.obey(bed.line_gap, stiffness))
    own.damping = state.lend("stem_damping", damping)
    own.slopes = state.lend("stem_slopes", state.arrays["slopes"].T)
    own.intercepts = state.lend("stem_intercepts", state.arrays["intercepts"].T)
    own.sorted = state.lend("stem_sorted", stiffness)
    own.loads = state.lend("stem_loads", stiffness)


@njit(error_model="numpy")
def law(t: Any) -> None:
    """Slopes and intercepts of the stems that are still held."""
    own, stiffness = stems_of(t), vector(t.stiffness, 1)[0]
    order, weight = indices(own.order, t.lines), vector(t.weight, t.lines)
    in_order = vector(own.sorted, t.lines)
    for s in range(t.lines):
        in_order[s] = weight[order[s]] * stiffness
    lay_law(t, own.sorted, own.slopes, own.intercepts)


@njit(error_model="numpy")
def lay(t: Any) -> None:
    """The law of the next step: of those still held, and implicitly of what damps those that
    bend."""
    own = stems_of(t)
    drag = own.drag / t.h
    slopes, intercepts = vector(t.slopes, t.lines), vector(t.intercepts, t.lines)
    held_slopes, held_intercepts = vector(own.slopes, t.lines), vector(own.intercepts, t.lines)
    for s in range(t.lines):
        slopes[s] = held_slopes[s] + drag
        intercepts[s] = held_intercepts[s] + drag * t.depth[0]


@compiled
def damp(t: Any) -> None:
    """The law in steps of this length."""
    lay(t)


@compiled
def bend(t: Any) -> None:
    """Let go of stems bent too far; the others damp the next step."""
    own = stems_of(t)
    weight, line_gap = vector(t.weight, t.lines), vector(t.line_gap, t.lines)
    damping = vector(own.damping, t.lines)
    gone, own.drag = False, 0.0
    for stem in range(t.lines):
        bent = t.depth[0] - line_gap[stem]
        if bent > own.slip_m and weight[stem] > 0.0:
            gone, weight[stem], damping[stem] = True, 0.0, 0.0
        if bent > 0.0:
            own.drag += damping[stem]
    if gone:
        law(t)
    lay(t)


@compiled
def draw(t: Any) -> None:
    """Each stem's load on the two rows it lies between."""
    own, stiffness = stems_of(t), vector(t.stiffness, 1)[0]
    weight, line_gap = vector(t.weight, t.lines), vector(t.line_gap, t.lines)
    taxel, following = indices(own.taxel, t.lines), indices(own.following, t.lines)
    part, loads = vector(own.part, t.lines), vector(own.loads, t.lines)
    image, whole = vector(t.image, t.rows * t.columns), 0.0
    for stem in range(t.lines):
        loads[stem] = max(t.depth[0] - line_gap[stem], 0.0) * weight[stem] * stiffness
        whole += loads[stem]
    image[:] = 0.0
    for stem in range(t.lines):
        load = loads[stem] * (t.force / (whole if whole > 0.0 else 1.0))
        image[taxel[stem]] += load * (1.0 - part[stem])
        image[following[stem]] += load * part[stem]
