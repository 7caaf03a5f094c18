"""A trial's sensor readings on the way from the load to whole counts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate import streams
from train.simulate.arm import Array, Mask
from train.simulate.scene_model import Scene, TrialSpec

FULL = 65535.0
"""The converter's highest reading."""
HALF = 32767.0
"""The highest reading of an axis that is positive and negative."""


@dataclass
class Readings:
    """The sensor readings of one trial, all frames at once.

    Attributes:
        scene: the scene of these sensors.
        trial: the trial.
        effects: the effects that the trial calls for.
        which: the trial's place in its batch.
        t: (frames,) seconds.
        counts: (frames, rows, cols) of each taxel.
        joints: (frames, dof) radians.
        times: (frames,) seconds, if a clock effect shifts them.
        arrives: (frames,) whether each frame arrives, if some are lost.
        valid: (rows, cols) whether each taxel works, if dead ones are known.
        tangential: (frames, rows, cols, 2) counts of both tangential axes, if there are
            any.
    """

    scene: Scene
    trial: TrialSpec
    effects: tuple[str, ...]
    which: int
    t: Array
    counts: NDArray[np.float32]
    joints: Array
    times: Array | None = None
    arrives: Mask | None = None
    valid: Mask | None = None
    tangential: NDArray[np.float32] | None = None

    def stream(self, effect: str) -> np.random.Generator:
        """An effect's random numbers in this trial."""
        return streams.stream(
            self.scene.seed,
            effect,
            self.trial.key,
            self.trial.number,
        )

    def frames(self) -> NDArray[np.uint16]:
        """(frames, rows, cols) whole counts within the converter's range."""
        return np.clip(np.rint(self.counts), 0.0, FULL).astype(np.uint16)

    def shear(self) -> NDArray[np.int16] | None:
        """(frames, rows, cols, 2) whole counts of both tangential axes, if there are
        any; 0 of taxels that are known to be dead."""
        if self.tangential is None:
            return None
        counts = np.clip(np.rint(self.tangential), -HALF, HALF).astype(np.int16)
        return counts if self.valid is None else counts * self.valid[:, :, None]
