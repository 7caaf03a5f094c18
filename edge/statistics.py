"""Statistics of accuracies."""

import math


def wilson(
    right: float,
    total: float,
    z: float = 1.959963984540054,
) -> tuple[float, float]:
    """Wilson's score interval of a proportion (95 % by default).

    Nothing right has the lower end 0, and everything right the upper end 1, exactly:
    the square root of a rounded square is the number itself.

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212.
    """
    zz = z * z
    spread = z * math.sqrt(zz + 4 * right * (1 - right / total))
    low = right + (zz - spread) / 2
    high = right + (zz + spread) / 2
    return low / (total + zz), high / (total + zz)
