"""One reading of the whole skin."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class Frame:
    """Taxel counts at one time.

    Rows run along the forearm from elbow to wrist, columns around it.
    """

    t: float
    """Seconds on a clock that never goes back."""
    counts: NDArray[np.uint16]
    """(rows, cols), above baseline."""
    valid: NDArray[np.bool_] | None = None
    """(rows, cols), which taxels could be read; None where all could."""
    times: NDArray[np.float64] | None = None
    """(rows, cols), when each taxel was read, in seconds; None where all were read at
    `t`."""
    joints: NDArray[np.float64] | None = None
    """(dof,) radians at `t`; None where unknown."""
    shear: NDArray[np.int16] | None = None
    """(rows, cols, 2) tangential counts along the rows and around the columns; None on
    a skin of one axis."""
