"""One reading of the whole skin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Booleans, Counts, Floats

ONSETS = ("first", "event")
"""What tells the onsets of touches other than the skin: the first frame of a recording,
or an event."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Taxel counts at one time.

    Rows run along the forearm from elbow to wrist, columns around it.
    """

    t: float
    """Seconds on a clock that never goes back."""
    counts: Counts
    """(rows, cols), above baseline."""
    valid: Booleans | None = None
    """(rows, cols), which taxels could be read; None where all could."""
    times: Floats | None = None
    """(rows, cols), when each taxel was read, in seconds; None where all were read at
    `t`."""
    joints: Floats | None = None
    """(dof,) radians at `t`; None where unknown."""
    shear: NDArray[np.int16] | None = None
    """(rows, cols, 2) tangential counts along the rows and around the columns; None on
    a skin of one axis."""
    onset: bool = False
    """A touch begins with this frame, as something other than the skin tells."""
