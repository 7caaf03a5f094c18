"""No reading above a limit: past 17 N the lab does not trust its skin."""

from __future__ import annotations

import numpy as np

from train.simulate.contact import State
from train.simulate.plan import Build


def add(build: Build) -> None:
    """Add it to the frames."""
    scale = build.scene.skin.counts_per_newton or 1.0
    limit = np.float32(build.settings("saturation")["newton"] * scale)

    def clip(state: State) -> None:
        """At most the limit."""
        np.minimum(state["counts"], limit, out=state["counts"])

    build.put("sensor", 50, clip)
