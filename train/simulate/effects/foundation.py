"""Elastic foundation: each taxel presses its own column of foam, E A / H newtons a metre.

With columns of foam side by side that do not feel each other, a cylinder of radius R at depth d
bears F/L = (4/3) (E/H) d sqrt(2 R d) (Winkler's foundation; Johnson, Contact Mechanics, 4.3).
"""

from __future__ import annotations

from train.simulate import base
from train.simulate.plan import Build
from train.simulate.state import State


def add(build: Build) -> None:
    """Put the foundation under the taxels."""
    build.put("setup", base.SPRINGS + 5, soften)


def soften(state: State) -> None:
    """The foam's column in series with the skin's taxel."""
    values, skin = state.values, state.skin
    area = skin.row_pitch_m * skin.column_pitch_m
    column = values["modulus_pa"] * area / values["depth_m"]
    state.taxel_k = 1.0 / (1.0 / state.taxel_k + 1.0 / column)
