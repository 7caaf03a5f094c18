"""No reading above a limit: past 17 N the lab does not trust its skin."""

from __future__ import annotations

import numpy as np

from train.simulate.plan import Build
from train.simulate.readings import Readings


def add(build: Build) -> None:
    """Add it to the frames."""
    scale = build.scene.skin.counts_per_newton or 1.0
    limit = np.float32(build.settings("saturation")["newton"] * scale)

    def clip(readings: Readings) -> None:
        """At most the limit."""
        np.minimum(readings.counts, limit, out=readings.counts)

    build.read("sensor", 50, clip)
