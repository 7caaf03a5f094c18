"""A sleeve over the skin: a spring in series, 1/k = 1/k_skin + 1/k_cover, that spreads
the load."""

import numpy as np

from train.simulate.trials import Index, Trials, pick


def soften(t: Trials, i: Index) -> None:
    """Put the sleeve in series with each taxel."""
    t.taxel_k[i] = 1.0 / (
        1.0 / pick(t.taxel_k, i) + 1.0 / pick(t.values["cover_n_m"], i)
    )


def pass_on(t: Trials, i: Index) -> None:
    """Move a part of each taxel's load to its four neighbours; none is lost at the
    skin's ends."""
    image = pick(t.image, i)
    spread = image * pick(t.values["cover_spread"], i)
    around = np.pad(spread, ((1, 1), (1, 1), (0, 0)), mode="edge")
    beside = around[1:-1, 2:] + around[1:-1, :-2]
    above = around[2:, 1:-1] + around[:-2, 1:-1]
    t.image[:, :, i] = image - 4.0 * spread + beside + above
