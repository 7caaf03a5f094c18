"""What about a contact is most unlike training, in words."""

from collections.abc import Mapping, Sequence

import numpy as np

from edge.arrays import Floats

PREFIXES = ("log_", "sqrt_", "relative_")
"""Of features' names, which say nothing to a person."""


def unusual(
    vector: Floats,
    widths: Sequence[int],
    usual: Mapping[str, Sequence[float]],
) -> str | None:
    """The most unusual property of a contact, as a phrase.

    Args:
        vector: of the full window.
        widths: number of values of each feature, in the order of `usual`.
        usual: {feature: the least and the greatest mean of nearly all training trials}.

    Returns:
        The phrase; None where the usual means are not known.
    """
    if not usual:
        return None
    phrase = "each feature is usual, but not all of them together"
    farthest = 0.0
    features = np.split(vector, np.cumsum(widths)[:-1])
    for values, (name, (low, high)) in zip(features, usual.items(), strict=True):
        mean = float(values.mean())
        beyond = max(low - mean, mean - high) / ((high - low) or 1.0)
        if beyond > farthest:
            farthest = beyond
            words = name.partition("@")[0]
            for prefix in PREFIXES:
                words = words.removeprefix(prefix)
            side = "higher" if mean > high else "lower"
            phrase = f"{words.replace('_', ' ')} {side} than in training"
    return phrase
