"""Sine, cosine and length of IEEE basic operations: the same bits on every machine.

The sine is Taylor's series, after the reduction of Cody and Waite (Software Manual for
the Elementary Functions, 1980, chapter 8): whole half turns are taken off, with pi in
two parts. For angles up to `MOST` it is wrong by at most 7e-16, the cosine by 1.4e-15.
"""

import math
from collections.abc import Iterable
from typing import Any

MOST = 1e6
"""Radians; an arm's joint does not turn so far."""
PER_HALF_TURN = 0.3183098861837907
HALF_TURN = 3.1416015625
HALF_TURN_REST = -8.908910206761537e-6
ROUNDING = 6755399441055744.0
"""1.5 times 2^52. Added and taken off, it rounds a number to a whole one."""


def sin(x: Any) -> Any:
    """Sine of radians, a number or an array."""
    turns = (x * PER_HALF_TURN + ROUNDING) - ROUNDING
    rest = (x - turns * HALF_TURN) - turns * HALF_TURN_REST
    square = rest * rest
    series = 1.0
    for n in range(22, 0, -2):
        series = 1.0 - series * square / (n * (n + 1))
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
