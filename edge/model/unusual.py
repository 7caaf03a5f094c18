"""What about a contact is most unlike training, in words."""

from collections.abc import Mapping, Sequence

PREFIXES = ("log_", "sqrt_", "relative_")
"""Of features' names, which say nothing to a person."""


def unusual(means: Sequence[float], usual: Mapping[str, Sequence[float]]) -> str:
    """The most unusual property of a contact, as a phrase.

    Args:
        means: of each feature over the window, in the order of `usual`.
        usual: {feature: the least and the greatest mean of nearly all training trials}.
    """
    phrase = "each feature is usual, but not all of them together"
    farthest = 0.0
    for mean, (name, (low, high)) in zip(means, usual.items(), strict=True):
        beyond = max(low - mean, mean - high) / ((high - low) or 1.0)
        if beyond > farthest:
            farthest = beyond
            words = name.partition("@")[0]
            for prefix in PREFIXES:
                words = words.removeprefix(prefix)
            side = "higher" if mean > high else "lower"
            phrase = f"{words.replace('_', ' ')} {side} than in training"
    return phrase
