"""A trial's sensor readings on the way from the load to whole counts."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.simulate import streams
from train.simulate.arm import Array, Mask
from train.simulate.scene_model import Scene, TrialSpec

FULL = 65535.0
"""The converter's highest reading."""


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
        kept: (frames,) whether each frame arrives, if some are lost.
        valid: (rows, cols) whether each taxel works, if dead ones are known.
    """

    scene: Scene
    trial: TrialSpec
    effects: tuple[str, ...]
    which: int
    t: Array
    counts: NDArray[np.float32]
    joints: Array
    times: Array | None = None
    kept: Mask | None = None
    valid: Mask | None = None

    def stream(self, effect: str) -> np.random.Generator:
        """An effect's random numbers in this trial."""
        return streams.stream(
            self.scene.seed, effect, self.trial.key, self.trial.number
        )

    def frames(self) -> NDArray[np.uint16]:
        """(frames, rows, cols) whole counts within the converter's range."""
        return np.clip(np.rint(self.counts), 0.0, FULL).astype(np.uint16)
