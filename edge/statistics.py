"""Statistics of accuracies."""

import math


def wilson(right: float, total: float, z: float = 1.959963984540054) -> tuple[float, float]:
    """Wilson's score interval of a proportion (95 % by default).

    Source: E. B. Wilson, J. Am. Stat. Assoc. 22 (1927), 209-212.
    """
    p, zz = right / total, z * z / total
    centre = (p + zz / 2) / (1 + zz)
    half = z / (1 + zz) * math.sqrt(p * (1 - p) / total + zz / (4 * total))
    return max(0.0, centre - half), min(1.0, centre + half)
