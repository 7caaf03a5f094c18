"""A trial's sensor readings on the way from the load to whole counts."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate import streams
from train.simulate.arm import Array, Mask, Places
from train.simulate.scene_model import Scene, TrialSpec

FULL = 65535.0
"""The converter's highest reading."""


@dataclass
class Readings:
    """The sensor readings of one trial, all frames at once.

    Most taxels never bear a load. An effect that leaves those at zero works on `counts`; any other
    effect asks for all taxels (`everywhere`).

    Attributes:
        scene: the scene of these sensors.
        trial: the trial.
        effects: the effects that the trial calls for.
        which: the trial's place in its batch.
        t: (frames,) seconds.
        counts: (frames, taxels) of those that bear a load in some frame, or of all.
        taxels: (taxels,) their places on the skin, row * cols + column.
        joints: (frames, dof) radians.
        times: (frames,) seconds, if a clock effect shifts them.
        kept: (frames,) whether each frame arrives, if some are lost.
        valid: (rows, cols) whether each taxel works, if dead ones are known.
    """

    scene: Scene
    trial: TrialSpec
    effects: tuple[str, ...]
    which: int
    t: Array
    counts: NDArray[Any]
    taxels: Places
    joints: Array
    times: Array | None = None
    kept: Mask | None = None
    valid: Mask | None = None

    @property
    def shape(self) -> tuple[int, int]:
        """The skin's rows and columns."""
        return self.scene.skin.rows, self.scene.skin.cols

    def stream(self, effect: str) -> np.random.Generator:
        """An effect's random numbers in this trial."""
        return streams.stream(self.scene.seed, effect, self.trial.key, self.trial.number)

    def everywhere(self) -> NDArray[Any]:
        """(frames, rows, cols) counts of all taxels, which `counts` holds from now on."""
        every = np.arange(self.shape[0] * self.shape[1])
        if not np.array_equal(self.taxels, every):
            counts = np.zeros((len(self.counts), len(every)), dtype=self.counts.dtype)
            counts[:, self.taxels] = self.counts
            self.counts, self.taxels = counts, every
        return self.counts.reshape(-1, *self.shape)

    def frames(self) -> NDArray[np.uint16]:
        """(frames, rows, cols) whole counts within the converter's range."""
        counts = np.zeros((len(self.counts), self.shape[0] * self.shape[1]), dtype=np.uint16)
        counts[:, self.taxels] = np.clip(np.rint(self.counts), 0.0, FULL)
        return counts.reshape(-1, *self.shape)
