"""Stems of a mass, which the forearm brings to its own speed as it meets them.

A stem at rest of mass m that is met at a speed v takes the impulse m v. On average half
of the step is left then, so the stem resists with 2 m / h^2 in the step that meets it.
No stem leaps ahead of the forearm: the blow is without rebound.
"""

import numpy as np

from train.simulate.effects.stems import tune
from train.simulate.trials import Trials


def predict(t: Trials) -> None:
    """Let the stems that the forearm has not met yet resist by their mass."""
    stems = t.states["stems"]
    rests = (stems.depth >= t.contact.depth[0]) & (stems.stiffness > 0.0)
    blow = 2.0 * t.values["stem_kg"] / t.clock.h**2
    stems.blow = np.where(rests, blow, 0.0)
    tune(t)
