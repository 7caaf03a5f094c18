"""The tables of convolution features: shifts and biases that training touches give."""

from collections.abc import Sequence

import numpy as np

from edge.arrays import Integers
from edge.features.kernels import (
    BITS,
    CONVOLUTIONS,
    SAMPLES,
    KernelTable,
    convolution_of_bias,
    convolved,
    shifted,
)

MOST_TOUCHES = 500
"""Touches that are enough for a table."""
GOLDEN = (np.sqrt(5.0) + 1.0) / 2.0


def kernel_table(touches: Sequence[Integers], biases: int, alike: bool) -> KernelTable:
    """Shifts and biases for the kernels of one feature. No label takes part.

    A bias is a quantile of its convolution's results on these touches. The quantiles of
    successive biases are the multiples of the golden ratio less their whole parts,
    which spread evenly.

    Args:
        touches: (channels, samples) of each touch, see
            `edge.features.kernels.kernel_channels`.
        biases: how many there are.
        alike: the channels have one unit and share a shift.
    """
    largest = np.max([touch.max(axis=1) for touch in touches], axis=0)
    if alike:
        largest[:] = largest.max()
    # One bit is kept for touches that are stronger than those of training.
    shifts = tuple(
        BITS - 1 - int(value).bit_length() if value else 0 for value in largest
    )
    by_touch = np.empty((CONVOLUTIONS, len(touches), SAMPLES), dtype=np.int32)
    for i, touch in enumerate(touches):
        by_touch[:, i] = convolved(shifted(touch, shifts))
    results = by_touch.reshape(CONVOLUTIONS, -1)
    results.sort(axis=1)
    shares = np.arange(1, biases + 1) * GOLDEN % 1.0
    places = (shares * results.shape[1]).astype(np.int64)
    values = results[convolution_of_bias(biases), places]
    return KernelTable(shifts, tuple(values.tolist()))
