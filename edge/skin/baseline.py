"""Counts above a baseline that follows slow drift, in integers: results repeat."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from edge.skin.file import Signal, SkinFile

SCALE_BITS = 12
"""The baseline is kept in 1/4096 counts, so that a slow drift is not lost to
rounding."""
FOLLOW_BITS = 2
"""A step is at most 1/4 of the distance, so that noise hardly moves the baseline."""


class Baseline:
    """The rest values of n taxels.

    Each call of `follow` moves them by at most `step_counts` towards the raw values,
    and never more than `limit` counts away from the calibration. Without calls they
    stay.
    """

    def __init__(
        self,
        rest: ArrayLike,
        *,
        sign: ArrayLike = 1,
        dead_band: ArrayLike = 1,
        step_counts: float = 0.0,
        limit: int = 0,
    ) -> None:
        """Start from a calibration.

        Args:
            rest: (n,) raw counts with nothing touching.
            sign: (n,) or a scalar, 1 where a touch raises the raw value, -1 where it
                lowers it.
            dead_band: (n,) or a scalar, counts under which a taxel reads 0; at least 1.
            step_counts: length of a step; rounded up to 1/4096 count.
            limit: greatest distance from `rest`, in counts.
        """
        self._rest = np.array(rest, dtype=np.int32) << SCALE_BITS
        n = self._rest.shape
        self._now = self._rest.copy()
        self._sign = np.broadcast_to(np.asarray(sign, dtype=np.int32), n)
        self._dead = np.broadcast_to(
            np.maximum(np.asarray(dead_band, dtype=np.int32), 1), n
        )
        self._step = int(np.ceil(step_counts * (1 << SCALE_BITS)))
        self._low = self._rest - (limit << SCALE_BITS)
        self._high = self._rest + (limit << SCALE_BITS)

    @property
    def counts(self) -> NDArray[np.int32]:
        """(n,) raw counts of the baseline."""
        return (self._now + (1 << (SCALE_BITS - 1))) >> SCALE_BITS

    def above(self, raw: NDArray[np.uint16]) -> NDArray[np.uint16]:
        """Counts above the baseline (n,), 0 to 65535, by sign and dead band."""
        counts = (raw.astype(np.int32) - self.counts) * self._sign
        counts *= counts >= self._dead
        return np.asarray(np.minimum(counts, 65535), dtype=np.uint16)

    def follow(self, raw: NDArray[np.uint16], valid: NDArray[np.bool_]) -> None:
        """Follow the drift of the `valid` taxels by a step; call it while nothing
        touches."""
        error = (raw.astype(np.int32) << SCALE_BITS) - self._now
        error += 1 << (FOLLOW_BITS - 1)
        error >>= FOLLOW_BITS
        self._now += np.clip(error, -self._step, self._step) * valid
        np.clip(self._now, self._low, self._high, out=self._now)


def deaf_taxels(skin: "SkinFile") -> list[tuple[int, int]]:
    """Working taxels (row, col) whose dead band reaches the contact threshold."""
    threshold = skin.layout.threshold_counts
    if not threshold:
        return []
    band = dead_band(skin).reshape(skin.layout.shape)
    deaf = np.argwhere((band >= threshold) & skin.layout.alive)
    return [(row, col) for row, col in deaf.tolist()]


def dead_band(skin: "SkinFile") -> NDArray[np.int32]:
    """(taxels,) counts under which a taxel reads 0."""
    noise = None if skin.calibration is None else skin.calibration.noise.ravel()
    return dead_band_of(skin.signal, noise, skin.layout.rows * skin.layout.cols)


def dead_band_of(
    signal: "Signal", noise: NDArray[np.float64] | None, values: int
) -> NDArray[np.int32]:
    """(values,) counts under which a value reads 0; at least 1, as none is negative.

    Args:
        signal: of the skin.
        noise: (values,) standard deviations; None without a calibration.
        values: number of them.
    """
    least = max(1, signal.dead_band_counts)
    if noise is None:
        return np.full(values, least, dtype=np.int32)
    sigma = np.ceil(np.minimum(signal.dead_band_sigma * noise, 65535.0))
    return np.maximum(least, sigma.astype(np.int32))
