"""Foliage: stems that stand at different depths, bend as cantilevers (k = 3 E I / L^3, one
number here), damp, and slip off the forearm once bent too far, for good."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from train.simulate import base, streams
from train.simulate.contact import Array, bed_law, share_out
from train.simulate.plan import Build
from train.simulate.state import Bed, State


@dataclass
class Stems:
    """The stems, (stems, n) each.

    Attributes:
        taxel, following: positions in the window's image of the two rows a stem lies between.
        part: of its load that the second row bears.
        order: of the stems by depth.
        damping: N s/m; 0 once a stem has slipped off.
        slopes, intercepts: the law of those still held, without damping.
    """

    taxel: NDArray[np.int64]
    following: NDArray[np.int64]
    part: Array
    order: NDArray[np.intp] = field(init=False)
    damping: Array = field(init=False)
    slopes: Array = field(init=False)
    intercepts: Array = field(init=False)


def add(build: Build) -> None:
    """Stems in place of the bed's rows."""
    build.replace(base.lay_bed, plant)
    build.replace(base.order_bed, stand)
    build.replace(base.image, draw)
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
    taxel = (low * window + column) * n + np.arange(n)
    beside = window * n if rows > 1 else 0
    state.keep(Stems(taxel=taxel, following=taxel + beside, part=row - low))


def stand(state: State) -> None:
    """The stems' law as lines K a - B, and what each damps: 2 zeta sqrt(k m)."""
    values, bed, own = state.values, state.bed, state.of(Stems)
    stiffness = bed.weight * bed.stiffness
    own.order = np.argsort(bed.line_gap, axis=0, kind="stable")
    own.damping = (2.0 * values["stem_damping"] * np.sqrt(stiffness * values["stem_kg"])) * (
        bed.weight > 0.0
    )
    law(bed, own)
    bed.slopes, bed.intercepts = own.slopes, own.intercepts


def law(bed: Bed, own: Stems) -> None:
    """Slopes and intercepts of the stems that are still held."""
    stiffness = bed.weight * bed.stiffness
    own.slopes, own.intercepts = bed_law(bed.line_gap, stiffness, own.order)


def bend(state: State) -> None:
    """Let go of stems bent too far; damp those that bend, implicitly, in the next step."""
    bed, own = state.bed, state.of(Stems)
    bent = state.depth[0] - bed.line_gap
    gone = (bent > state.values["stem_slip_m"]) & (bed.weight > 0.0)
    if gone.any():
        bed.weight = np.where(gone, 0.0, bed.weight)
        own.damping = np.where(gone, 0.0, own.damping)
        law(bed, own)
    drag = np.add.accumulate(np.where(bent > 0.0, own.damping, 0.0), axis=0)[-1]
    drag = drag / state.h
    bed.slopes = own.slopes + drag
    bed.intercepts = own.intercepts + drag * state.depth[0]


def draw(state: State) -> None:
    """Each stem's load on the two rows it lies between."""
    bed, own = state.bed, state.of(Stems)
    bent = np.maximum(state.depth[0] - bed.line_gap, 0.0)
    loads = (bent * bed.weight * bed.stiffness)[:, None]
    loads = share_out(state.force, loads)[:, 0]
    rows, window = state.skin.rows, state.columns.shape[0]
    cells = np.stack([own.taxel, own.following], axis=1)
    parts = np.stack([loads * (1.0 - own.part), loads * own.part], axis=1)
    image = np.zeros_like(parts, shape=rows * window * state.n)
    np.add.at(image, cells, parts)
    state.image = image.reshape(rows, window, state.n)
