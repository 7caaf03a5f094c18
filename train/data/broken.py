"""Taxels that look broken in a set: constant, or above the threshold, in every
recording."""

import numpy as np

from edge.arrays import Booleans, Integers
from edge.errors import counted, places_text
from edge.record.recording import Recording
from edge.touch.layout import SkinLayout
from edge.wire.skin.calibration import places

FEWEST = 3
"""Fewer recordings do not tell."""


class BrokenTaxels:
    """Gathers what a set's recordings show of each taxel.

    >>> taxels = BrokenTaxels()
    >>> for seed in range(3):
    ...     frames = np.zeros((2, 1, 4), np.uint16)
    ...     frames[:, 0, 1] = 7
    ...     taxels.add(Recording(np.array([0.0, 0.1]), frames))
    >>> taxels.places(SkinLayout(1, 4, threshold_counts=20))
    [(0, 1)]
    """

    def __init__(self) -> None:
        self._recordings = 0
        self._constant: Booleans = np.array(True)
        self._lowest: Integers = np.array(65535)

    def add(self, recording: Recording) -> None:
        """Take in a recording; one of another shape than the first counts for none."""
        frames = recording.frames
        if self._recordings and frames.shape[1:] != self._lowest.shape:
            return
        if recording.valid is not None:
            frames = frames * recording.valid
        lowest = frames.min(axis=0)
        self._recordings += 1
        self._constant = self._constant & (lowest > 0) & (lowest == frames.max(axis=0))
        self._lowest = np.minimum(self._lowest, lowest)

    def places(self, layout: SkinLayout) -> list[tuple[int, int]]:
        """(row, col) of each; none where they are half of the skin, as in recordings
        that begin and end in contact.

        Args:
            layout: with the threshold, and the taxels that are left out already.
        """
        if self._recordings < FEWEST:
            return []
        broken = self._constant | (self._lowest > layout.threshold_counts)
        broken &= layout.alive
        return [] if broken.mean() >= 0.5 else places(broken)

    def notes(self, layout: SkinLayout) -> list[str]:
        """A warning that names them, if there are any, and the option that leaves them
        out."""
        broken = self.places(layout)
        if not broken:
            return []
        option = " ".join(f"{row},{col}" for row, col in broken)
        return [
            f"warning: in all recordings {counted(len(broken), 'taxel')} have a constant "
            f"count or one above the threshold: {places_text(broken)}; `edge-classify "
            f"export --dead {option}` leaves them out, if they are broken"
        ]
