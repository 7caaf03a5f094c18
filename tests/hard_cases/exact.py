"""Oracles that do not round: a float64 is a whole number times a power of two."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.object_]


def whole(*arrays: NDArray[np.float64]) -> tuple[list[Whole], int]:
    """The arrays as Python integers times one power of two, and its exponent."""
    parts = [np.frexp(np.asarray(a, dtype=np.float64)) for a in arrays]
    low = min((int(e[m != 0.0].min()) for m, e in parts if (m != 0.0).any()), default=0)
    out: list[Whole] = []
    for mantissa, exponent in parts:
        scaled = np.ldexp(mantissa, 53).astype(np.int64)
        shifts = np.where(mantissa != 0.0, exponent - low, 0)
        flat = [int(m) << int(s) for m, s in zip(scaled.ravel(), shifts.ravel(), strict=True)]
        out.append(np.array(flat, dtype=object).reshape(mantissa.shape))
    return out, low - 53


def coordinates(
    vectors: NDArray[np.float64],
    mean: NDArray[np.float64],
    gain: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> tuple[Whole, int]:
    """(x - mean) * gain @ weights without rounding: (n, c) whole numbers and their exponent."""
    (x, m), first = whole(vectors, mean)
    (g,), second = whole(gain)
    (w,), third = whole(weights)
    return ((x - m) * g) @ w, first + second + third


def nearest(rows: Whole, query: Whole, k: int) -> tuple[list[int], list[int]]:
    """The k nearest rows, equal distances in the order of the rows, and the squares of all."""
    squares = ((rows - query) ** 2).sum(axis=1).tolist() if rows.shape[1] else [0] * len(rows)
    return sorted(range(len(rows)), key=lambda i: (squares[i], i))[:k], squares


def winner(labels: list[int]) -> int:
    """The majority of the neighbours' labels, nearest first; ties to the nearest of the tied."""
    votes = {label: labels.count(label) for label in labels}
    most = max(votes.values())
    return next(label for label in labels if votes[label] == most)


def root_error(seen: float, square: int, exponent: int) -> float:
    """|seen - sqrt(square * 2^exponent)| over the root; a root of 0 allows nothing."""
    exact = Fraction(square) * Fraction(2) ** exponent
    if exact == 0:
        return 0.0 if seen == 0.0 else math.inf
    # (a^2 - b^2) / b^2 is twice the relative error of a.
    return abs(float((Fraction(seen) ** 2 - exact) / exact)) / 2.0


def rank(rows: NDArray[np.int64]) -> int:
    """Rank of a matrix of integers, by elimination in fractions."""
    left = [[Fraction(int(v)) for v in row] for row in rows]
    found = 0
    for column in range(rows.shape[1]):
        pivot = next((i for i in range(found, len(left)) if left[i][column] != 0), None)
        if pivot is None:
            continue
        left[found], left[pivot] = left[pivot], left[found]
        for i in range(found + 1, len(left)):
            if left[i][column] != 0:
                share = left[i][column] / left[found][column]
                left[i] = [a - share * b for a, b in zip(left[i], left[found], strict=True)]
        found += 1
        if found == len(left):
            break
    return found
