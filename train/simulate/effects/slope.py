"""A table that is not level: the weight's part along it adds to what friction bears, or takes from
it. On a slope of angle b, uphill along the push, m g (mu cos b + sin b) moves a thing."""

from __future__ import annotations

import numpy as np

from train.simulate.plan import Index
from train.simulate.trials import Trials, pick


def stand(t: Trials, i: Index) -> None:
    """The slope as a change of the coefficients; a thing does not set off by itself."""
    mover, angle = t.own["sliding"], np.radians(pick(t.values["slope_deg"], i))
    for friction in (mover.static, mover.kinetic):
        friction[i] = np.maximum(pick(friction, i) * np.cos(angle) + np.sin(angle), 0.0)
