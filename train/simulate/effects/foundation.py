"""Elastic foundation: each taxel presses its own column of foam, of E A / H newtons a
metre.

On such independent columns a cylinder of radius R at depth d bears F/L = (4/3) (E/H) d
sqrt(2 R d) (Winkler's foundation; Johnson, Contact Mechanics, 4.3).
"""

import numpy as np

from train.simulate.trials import Trials


def soften(t: Trials) -> None:
    """Put a column of foam in series with each taxel."""
    pitch = t.scene.skin.pitch
    column = t.values["modulus_pa"] * (pitch[0] * pitch[1]) / t.values["depth_m"]
    t.bed.taxel_k = 1.0 / (1.0 / t.bed.taxel_k + 1.0 / column)
    t.contact.fits = np.array(1.0)
