"""Elementary functions of IEEE basic operations: the same bits on every machine.

Each takes the argument into a small range, as in Cody and Waite (Software Manual for
the Elementary Functions, 1980), with pi and log(2) in two parts. There it sums up
Taylor's series; that of the logarithm is in s of log((1 + s) / (1 - s)). Sines are
wrong by at most 7e-16, cosines by 1.4e-15, up to `MOST_RAD`; logarithms by less than
three units in the last place. Numbers and arrays get the same bits.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np

MOST_RAD = 1e6
"""An arm's joint does not turn so far."""
PER_HALF_TURN = 0.3183098861837907
HALF_TURN = 3.1416015625
HALF_TURN_REST = -8.908910206761537e-6
LN2 = 0.6931471805599453
LN2_HIGH = 0.6931471803691238
LN2_LOW = 1.9082149292705877e-10
SQRT_HALF = 0.7071067811865476
ROUNDING = 6755399441055744.0
"""1.5 times 2^52. Added and taken off, it rounds a number to a whole one."""
OF_SINE = tuple(float(n * (n + 1)) for n in range(22, 0, -2))
"""Divisors of the series of the sine, the last term's first."""


def sin(x: Any) -> Any:
    """Sine of radians, a number or an array."""
    turns = (x * PER_HALF_TURN + ROUNDING) - ROUNDING
    rest = (x - turns * HALF_TURN) - turns * HALF_TURN_REST
    square = rest * rest
    series = 1.0
    for divisor in OF_SINE:
        series = 1.0 - series * square / divisor
    odd = turns - 2.0 * ((0.5 * turns + ROUNDING) - ROUNDING)
    return rest * series * (1.0 - 2.0 * odd * odd)


def cos(x: Any) -> Any:
    """Cosine of radians, a number or an array."""
    half = sin(0.5 * x)
    return 1.0 - 2.0 * half * half


def length(vector: Iterable[float]) -> float:
    """Of a vector (3,) below 1e150."""
    x, y, z = vector
    return math.sqrt(x * x + y * y + z * z)


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
    """1 / (1 + exp(-x)), to a relative error of 4e-15; it never falls as x rises.

    Each step takes the former one's result into a number that only rises with it, or
    only falls: the terms of the series are positive, and a power of two begins where
    the one before it is cut off.
    """
    size = min(700.0, abs(x))  # flat beyond; of NaN the first
    power = int(size / LN2)
    rest = max(0.0, (size - power * LN2_HIGH) - power * LN2_LOW)
    series = 1.0
    for n in range(16, 0, -1):
        series = 1.0 + rest * series / n
    odds = math.ldexp(min(series, 2.0), power)
    return 1.0 / (1.0 + (1.0 / odds if x > 0.0 else odds))
