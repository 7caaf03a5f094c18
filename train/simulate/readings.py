"""What the sensors read of a trial, on its way from the load to whole counts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit
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
            counts = np.zeros((len(self.counts), len(every)), dtype=self.counts.dtype)
            counts[:, self.taxels] = self.counts
            self.counts, self.taxels = counts, every
        return self.counts.reshape(-1, *self.shape)

    def frames(self) -> NDArray[np.uint16]:
        """(frames, rows, cols) whole counts within the converter's range."""
        whole = np.zeros((len(self.counts), self.shape[0] * self.shape[1]), dtype=np.uint16)
        show(self.counts, self.taxels, whole)
        return whole.reshape(-1, *self.shape)


@njit(cache=True)
def show(counts: NDArray[Any], taxels: NDArray[np.intp], whole: NDArray[np.uint16]) -> None:
    """The nearest whole counts (frames, taxels of the skin) that the converter can read, of the
    taxels (frames, n) that have any."""
    for k in range(len(counts)):
        for i in range(len(taxels)):
            whole[k, taxels[i]] = np.uint16(min(max(np.rint(counts[k, i]), 0.0), FULL))
