"""A sleeve over the skin: a spring in series, 1/k = 1/k_skin + 1/k_cover, that spreads
the load."""

import numpy as np

from train.simulate.trials import Trials


def soften(t: Trials) -> None:
    """Put the sleeve in series with each taxel."""
    t.bed.taxel_k = 1.0 / (1.0 / t.bed.taxel_k + 1.0 / t.values["cover_n_m"])


def pass_on(t: Trials) -> None:
    """Move a part of each taxel's load to its four neighbours; none is lost at the
    skin's ends."""
    image = t.touch.image
    spread = image * t.values["cover_spread"]
    around = np.pad(spread, ((1, 1), (1, 1), (0, 0)), mode="edge")
    beside = around[1:-1, 2:] + around[1:-1, :-2]
    above = around[2:, 1:-1] + around[:-2, 1:-1]
    t.touch.image = image - 4.0 * spread + beside + above
