"""The one definition of distance, which pipeline, cross-validation and graph share.

Squares of the differences are added one component after another, in float64. Each step is one
operation whose rounding IEEE 754 fixes, and nothing is left to the order in which a library or a
processor adds: the same file gives the same bits everywhere. ONNX says it as Mul and CumSum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def running_squares(rows: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """(c, n) squared distances of z (c,) to rows (n, c), by the first 1 to c components."""
    gaps = (rows - z).T
    return np.cumsum(gaps * gaps, axis=0)


def squared_distances(rows: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) squared distances of z (c,) to rows (n, c); 0 where there is no component."""
    return running_squares(rows, z)[-1] if len(z) else np.zeros(len(rows))
