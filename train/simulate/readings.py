"""What the sensors read of a trial, on its way from the load to whole counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.compiled import Array
from train.simulate.run_frames import FULL
from train.simulate.scene_model import TrialSpec


@dataclass
class Readings:
    """What the sensors read of one trial, all frames at once.

    Most taxels of a skin never bear anything. What leaves those at zero works on the others alone;
    what does not asks for all of them (`everywhere`).

    Attributes:
        seed: the scene's.
        which: the trial's place in its batch.
        t: (frames,) seconds.
        counts: (frames, taxels), of those that bear something in some frame, or of all.
        taxels: (taxels,) where on the skin they are: row * cols + column.
        shape: the skin's rows and cols.
        joints: (frames, dof) radians.
        times: (frames,) seconds, where a clock effect shifts them.
        kept: (frames,) bool, where frames are lost.
        valid: (rows, cols) bool, where taxels are known to be dead.
    """

    seed: int
    which: int
    trial: TrialSpec
    t: Array
    counts: NDArray[Any]
    taxels: NDArray[np.intp]
    shape: tuple[int, int]
    joints: Array
    times: Array | None = None
    kept: NDArray[np.bool_] | None = None
    valid: NDArray[np.bool_] | None = None

    def everywhere(self) -> NDArray[Any]:
        """(frames, rows, cols) counts of all taxels: `counts` has them from here on."""
        every = np.arange(self.shape[0] * self.shape[1])
        if not np.array_equal(self.taxels, every):
            self.counts, self.taxels = self._spread(self.counts, self.counts.dtype), every
        return self.counts.reshape(-1, *self.shape)

    def frames(self) -> NDArray[np.uint16]:
        """(frames, rows, cols) whole counts within the converter's range."""
        whole = np.clip(np.rint(self.counts), 0.0, FULL)
        return self._spread(whole, np.uint16).reshape(-1, *self.shape)

    def _spread(self, counts: NDArray[Any], kind: Any) -> NDArray[Any]:
        """(frames, all taxels) of this kind, zero where there are no counts."""
        out = np.zeros((len(counts), self.shape[0] * self.shape[1]), dtype=kind)
        out[:, self.taxels] = counts
        return out
