"""A table that is not level: the weight's component along it adds to friction or takes
from it.

On a slope of angle b, uphill along the push, m g (mu cos b + sin b) moves an object.
"""

import numpy as np

from train.simulate.trials import Index, Trials, pick


def stand(t: Trials, i: Index) -> None:
    """Change the coefficients of friction by the slope; no object starts by itself."""
    mover = t.states["sliding"]
    angle = np.radians(pick(t.values["slope_deg"], i))
    for friction in (mover.static, mover.kinetic):
        friction[i] = np.maximum(pick(friction, i) * np.cos(angle) + np.sin(angle), 0.0)
