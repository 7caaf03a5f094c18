"""Logarithm and logistic curve of IEEE basic operations: the same bits on every machine.

Powers of two are taken off exactly, with log(2) in two parts as in fdlibm (Sun
Microsystems, 1993). What is left goes into Taylor's series: that of exp(x), and that of
log((1 + s) / (1 - s)) (Abramowitz and Stegun, Handbook of Mathematical Functions, 1964,
4.1.27). Logarithms are wrong by less than three units in the last place.
"""

import math
from typing import Any

import numpy as np

LN2_HIGH = 0.6931471803691238
LN2_LOW = 1.9082149292705877e-10
SQRT_HALF = 0.7071067811865476


def log(x: Any) -> Any:
    """Natural logarithm of a number above 0, or of an array of them."""
    fraction, power = np.frexp(x)
    low = fraction < SQRT_HALF
    power = power - low
    f = fraction * (1.0 + low) - 1.0
    s = f / (2.0 + f)
    square = s * s
    series = 0.0
    for n in range(23, 0, -2):
        series = series * square + 2.0 / n
    return power * LN2_HIGH + (power * LN2_LOW + s * series)


def logistic(x: float) -> float:
    """1 / (1 + exp(-x)), to a relative error of 5e-16."""
    size = min(700.0, abs(x))  # flat beyond; of NaN the first
    power = round(size / LN2_HIGH)
    rest = (power * LN2_HIGH - size) + power * LN2_LOW
    series = 1.0
    for n in range(14, 0, -1):
        series = 1.0 + rest * series / n
    small = math.ldexp(series, -power)
    return (1.0 if x > 0.0 else small) / (1.0 + small)
