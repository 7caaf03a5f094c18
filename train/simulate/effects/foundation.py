"""Elastic foundation: each taxel presses its own column of foam, E A / H newtons a metre.

With columns of foam side by side that do not feel each other, a cylinder of radius R at depth d
bears F/L = (4/3) (E/H) d sqrt(2 R d) (Winkler's foundation; Johnson, Contact Mechanics, 4.3).
"""

from __future__ import annotations

from train.simulate.plan import Index
from train.simulate.trials import Trials, pick


def soften(t: Trials, i: Index) -> None:
    """The foam's column in series with the skin's taxel."""
    area = t.skin.row_pitch_m * t.skin.column_pitch_m
    column = pick(t.values["modulus_pa"], i) * area / pick(t.values["depth_m"], i)
    t.taxel_k[i] = 1.0 / (1.0 / pick(t.taxel_k, i) + 1.0 / column)
