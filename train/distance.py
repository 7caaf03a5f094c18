"""The one definition of distance, which pipeline, cross-validation and graph share.

Squares of the differences are added one component after another, in float64. Each step is one
operation whose rounding IEEE 754 fixes, and nothing is left to the order in which a library or a
processor adds: the same coordinates give the same bits everywhere. ONNX says it as Mul and CumSum.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

ROUNDING = 2.0**-53


def running_squares(rows: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """(c, n) squared distances of z (c,) to rows (n, c), by the first 1 to c components."""
    gaps = (rows - z).T
    return np.cumsum(gaps * gaps, axis=0)


def squared_distances(rows: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) squared distances of z (c,) to rows (n, c); 0 where there is no component."""
    return running_squares(rows, z)[-1] if len(z) else np.zeros(len(rows))


def resolution(weights: NDArray[np.float64], limit: float) -> tuple[float, float]:
    """How near two distances may be that exact arithmetic orders otherwise.

    Let u = 2^-53, L the limit, w the weights, A the 2-norm of their columns' sums of
    absolute values and F their 2-norm (F <= A). A query of scaled differences d from the mean,
    with |d| <= L, has a coordinate vector that is wrong by at most (A + 3 F) u L: each d is
    rounded twice (2 u |d|) and cut off at the grid (u L), the sums of products are exact, and
    their two halves are added once (u |d| F). A training row has |d| <= L / 4 in each column and
    is wrong by at most 7/4 A u L. By the triangle inequality the difference of two distances is
    wrong by twice the sum of both, at most 6 (A + F) u L. Differences, squares, their sum and its
    root (Higham, Accuracy and Stability, section 3.1) add (c + 4) u of the distance itself.

    Beyond L the sums of products round too, by at most 2 p u F |d| for p columns, and splitting
    by 8 u F |d|: the first part times (p + 4) |d| / L then bounds all.

    Args:
        weights: (p, c), of a `train.projection.Projection`.
        limit: up to which differences are added up exactly.

    Returns:
        What does not depend on the distance, and the part of the distance, with some to spare.
    """
    sums = float(np.linalg.norm(np.abs(weights).sum(axis=0)))
    fixed = 6.0 * (sums + float(np.linalg.norm(weights))) * ROUNDING * limit
    return fixed, (weights.shape[1] + 8) * ROUNDING
