"""Intervals of accuracies and of their differences."""

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


def paired(gained: int, lost: int, total: int) -> tuple[float, float]:
    """The 95 % interval of the difference of two proportions of the same trials.

    It holds the true difference in at least 93 of 100 samples of 5 trials or more,
    whatever the true shares gained and lost, as a test enumerates.

    Source: D. G. Bonett and R. M. Price, J. Educ. Behav. Stat. 37 (2012), 479-488, with
    Fleiss's correction for continuity, 1 / total. It is weighted by the share of the
    trials that differ, because the difference takes larger steps where most do.

    Args:
        gained: trials that count in the second proportion alone.
        lost: trials that count in the first one alone.
        total: all trials.
    """
    more = (gained + 1) / (total + 2)
    less = (lost + 1) / (total + 2)
    change = more - less
    reach = Z * math.sqrt((more + less - change**2) / (total + 2))
    reach += (more + less) / total
    return max(change - reach, -1.0), min(change + reach, 1.0)
