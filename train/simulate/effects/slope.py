"""A table that is not level: the weight's component along it adds to friction or takes
from it.

On a slope of angle b, uphill along the push, m g (mu cos b + sin b) moves an object.
"""

import numpy as np

from train.simulate.trials import Trials


def stand(t: Trials) -> None:
    """Change the coefficients of friction by the slope; no object starts by itself."""
    mover = t.states["sliding"]
    angle = np.radians(t.values["slope_deg"])
    level = np.cos(angle)
    uphill = np.sin(angle)
    mover.static = np.maximum(mover.static * level + uphill, 0.0)
    mover.kinetic = np.maximum(mover.kinetic * level + uphill, 0.0)
