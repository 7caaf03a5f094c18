"""Oracles that do not round: Python's whole numbers and fractions."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.projection import MOST_STEPS, Projection

Whole = NDArray[np.object_]


def multiples(values: NDArray[np.float64], unit: float) -> Whole:
    """Values over a power of two, as Python integers.

    Raises:
        ValueError: a value is no multiple of it.
    """
    exact = [Fraction(value) / Fraction(unit) for value in np.ravel(values).tolist()]
    if any(value.denominator != 1 for value in exact):
        raise ValueError(f"not all multiples of {unit}")
    return np.array([int(value) for value in exact], dtype=object).reshape(
        np.shape(values)
    )


def smallest_bit(values: NDArray[np.float64]) -> float:
    """The largest power of two of which all values are multiples; 1 for zeros."""
    ratios = [Fraction(value) for value in np.ravel(values).tolist() if value]
    bits = [
        (r.numerator & -r.numerator).bit_length() - r.denominator.bit_length()
        for r in ratios
    ]
    return math.ldexp(1.0, min(bits, default=0))


def coordinates(vectors: NDArray[np.float64], p: Projection, components: int) -> Whole:
    """(n, c) whole coordinates of vectors by the rule of `train.projection`.

    The difference from the mean and its product with the gain are rounded once each, as
    IEEE 754 says; all that follows is in Python's whole numbers.
    """
    d = (vectors - p.mean_) * p.gain_ / p.grid_.step
    bound = int(MOST_STEPS)
    rounded = [
        max(-bound, min(bound, round(Fraction(value))))
        for value in np.ravel(d).tolist()
    ]
    steps = np.array(rounded, dtype=object).reshape(d.shape)
    weights = p.weights_[:, :components]
    bit = smallest_bit(weights)
    scale = Fraction(bit) * Fraction(p.grid_.step) / Fraction(p.grid_.unit)
    sums = (
        steps @ multiples(weights, bit)
        if components
        else np.zeros((len(d), 0), dtype=object)
    )
    limit = int(p.grid_.limit)
    units = [
        max(-limit, min(limit, round(value * scale)))
        for value in np.ravel(sums).tolist()
    ]
    return np.array(units, dtype=object).reshape(sums.shape)


def unrounded(
    vectors: NDArray[np.float64],
    mean: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> Whole:
    """(n, c) whole numbers proportional to (x - mean) @ weights, without any
    rounding."""
    bit = smallest_bit(np.concatenate([vectors.ravel(), mean]))
    d = multiples(vectors, bit) - multiples(mean, bit)
    return np.asarray(d @ multiples(weights, smallest_bit(weights)))


def nearest(rows: Whole, query: Whole, k: int) -> tuple[list[int], list[int]]:
    """The k nearest rows, equal distances in the order of the rows, and the squares of
    all."""
    squares = (
        ((rows - query) ** 2).sum(axis=1).tolist() if rows.shape[1] else [0] * len(rows)
    )
    return sorted(range(len(rows)), key=lambda i: (squares[i], i))[:k], squares


def winner(labels: list[Any]) -> Any:
    """The majority of the neighbours' labels, nearest first; ties to the nearest of the
    tied."""
    votes = {label: labels.count(label) for label in labels}
    most = max(votes.values())
    return next(label for label in labels if votes[label] == most)


def distance(square: int, unit: float) -> float:
    """The root of a whole number, correctly rounded, in units of a power of two."""
    return (
        math.sqrt(square) * unit
    )  # below 2^53 the number is a float64, whose root IEEE rounds
