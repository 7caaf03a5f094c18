"""Statistics of accuracies."""

import math

Z = 1.959963984540054
"""Quantile of the normal distribution for a confidence of 95 %."""


def wilson(right: float, total: float) -> tuple[float, float]:
    """Wilson's score interval of a proportion, at a confidence of 95 %.

    Nothing right has the lower end 0, and everything right the upper end 1, exactly:
    the square root of a rounded square is the number itself.

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212.
    """
    spread = Z * math.sqrt(Z * Z + 4 * right * (1 - right / total))
    low = right + (Z * Z - spread) / 2
    high = right + (Z * Z + spread) / 2
    return low / (total + Z * Z), high / (total + Z * Z)
