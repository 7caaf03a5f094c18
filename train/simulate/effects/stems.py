"""Foliage: stems that stand at different depths, bend as cantilevers (k = 3 E I / L^3, one
number here), damp, and slip off the forearm once bent too far, for good."""

from __future__ import annotations

import numpy as np

from train.simulate import base, streams
from train.simulate.contact import State, share_out
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Stems in place of the bed's rows."""
    build.replace(base.lay_bed, plant)
    build.replace(base.order_bed, stand)
    build.replace(base.image, draw)
    build.put("step", base.SETTLE + 10, bend)


def plant(state: State) -> None:
    """Where the stems stand: (stems, n) depths, rows, columns and stiffnesses."""
    values = state["values"]
    count = int(values["stem_count"][0])
    n, rows = state["n"], state["scene"].skin.rows
    shape = (count, n)
    depth, along, around, stiffness = (np.empty(shape) for _ in range(4))
    for i, trial in enumerate(state["trials"]):
        generator = streams.stream(state["scene"].seed, "stems", trial.key, trial.number)
        depth[:, i] = generator.random(count)
        along[:, i] = generator.random(count)
        around[:, i] = generator.integers(-1, 2, count)
        stiffness[:, i] = np.exp(0.3 * generator.standard_normal(count))
    depth -= depth.min(axis=0)
    state["line_gap"] = depth * values["stem_spread_m"]
    state["weight"] = stiffness
    state["stiffness"] = values["stem_n_m"][None]
    state["gaps"] = np.zeros((1, n))
    state["lines"] = slice(0, rows)
    half = 0.5 * np.minimum(values["width_m"], rows * state["row_pitch"])
    middle = (state["row_z"][0] - state["z"]) / state["row_pitch"]
    reach = half / state["row_pitch"]
    row = np.clip(middle + (2.0 * along - 1.0) * reach, 0.0, rows - 1.001)
    window = state["columns"].shape[0]
    column = (window // 2 + around).astype(np.int64)
    low = np.floor(row).astype(np.int64)
    state["stem_taxel"] = (low * window + column) * n + np.arange(n)
    state["stem_next"] = state["stem_taxel"] + window * n
    state["stem_part"] = row - low


def stand(state: State) -> None:
    """The stems' law as lines K a - B, and what each damps: 2 zeta sqrt(k m)."""
    values = state["values"]
    stiffness = state["weight"] * state["stiffness"]
    state["stem_order"] = np.argsort(state["line_gap"], axis=0, kind="stable")
    state["damping"] = (2.0 * values["stem_damping"] * np.sqrt(stiffness * values["stem_kg"])) * (
        state["weight"] > 0.0
    )
    law(state)
    state["slopes"], state["intercepts"] = state["stem_slopes"], state["stem_intercepts"]


def law(state: State) -> None:
    """Slopes and intercepts of the stems that are still held."""
    stiffness = np.take_along_axis(state["weight"] * state["stiffness"], state["stem_order"], 0)
    gaps = np.take_along_axis(state["line_gap"], state["stem_order"], 0)
    state["stem_slopes"] = np.add.accumulate(stiffness, axis=0)
    state["stem_intercepts"] = np.add.accumulate(stiffness * gaps, axis=0)


def bend(state: State) -> None:
    """Let go of stems bent too far; damp those that bend, implicitly, in the next step."""
    bent = state["depth"][0] - state["line_gap"]
    gone = (bent > state["values"]["stem_slip_m"]) & (state["weight"] > 0.0)
    if gone.any():
        state["weight"] = np.where(gone, 0.0, state["weight"])
        state["damping"] = np.where(gone, 0.0, state["damping"])
        law(state)
    drag = np.add.accumulate(np.where(bent > 0.0, state["damping"], 0.0), axis=0)[-1]
    drag = drag / state["h"]
    state["slopes"] = state["stem_slopes"] + drag
    state["intercepts"] = state["stem_intercepts"] + drag * state["depth"][0]


def draw(state: State) -> None:
    """Each stem's load on the two rows it lies between."""
    bent = np.maximum(state["depth"][0] - state["line_gap"], 0.0)
    loads = (bent * state["weight"] * state["stiffness"])[:, None]
    loads = share_out(state["force"], loads)[:, 0]
    rows, window = state["scene"].skin.rows, state["columns"].shape[0]
    image = np.zeros(rows * window * state["n"])
    for taxel, after, part, load in zip(
        state["stem_taxel"], state["stem_next"], state["stem_part"], loads, strict=True
    ):
        image[taxel] += load * (1.0 - part)
        image[after] += load * part
    state["image"] = image.reshape(rows, window, state["n"])[:, window // 2 - 1 : window // 2 + 2]
    state["image_from"] = window // 2 - 1
