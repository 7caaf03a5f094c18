"""Oracles that do not round: Python's whole numbers and fractions."""

import math
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from train.model.outlier_score import CLIP, FARTHEST, STEP_BITS
from train.model.projection import MOST_STEPS


def by_element(function, values):
    """Python's numbers that a function makes of each element of an array."""
    return np.vectorize(function, otypes=[object])(values)


def multiples(values, unit):
    """Values over a power of two, as Python integers.

    Raises:
        ValueError: a value is no multiple of it.
    """
    quotients = by_element(lambda value: Fraction(value) / Fraction(unit), values)
    if any(quotient.denominator != 1 for quotient in quotients.flat):
        raise ValueError(f"not all multiples of {unit}")
    return by_element(int, quotients)


def smallest_bit(values):
    """The largest power of two of which all values are multiples; 1 for zeros."""
    ratios = [Fraction(value) for value in np.ravel(values).tolist() if value]
    bits = [
        (r.numerator & -r.numerator).bit_length() - r.denominator.bit_length()
        for r in ratios
    ]
    return math.ldexp(1.0, min(bits, default=0))


class Projected(NamedTuple):
    """Vectors in a projection's whole numbers.

    Attributes:
        units: (n, c) coordinates, cut off at the limit.
        cut: (n,) whether a step or a coordinate was cut off.
    """

    units: NDArray[np.object_]
    cut: NDArray[np.bool_]


def rounded(values, scale=Fraction(1)):
    """Numbers times a scale, to the nearest whole number, halves to the even one."""
    return by_element(lambda value: round(Fraction(value) * scale), values)


def projected(vectors, p):
    """Whole coordinates of vectors by the rule of `train.model.projection`.

    The difference from the mean and its product with the gain are rounded once each, as
    IEEE 754 says; all that follows is in Python's whole numbers.
    """
    steps = rounded((vectors - p.mean_) * p.gain_ / p.grid_.step)
    inside = np.clip(steps, -int(MOST_STEPS), int(MOST_STEPS))
    bit = smallest_bit(p.weights_)
    scale = Fraction(bit) * Fraction(p.grid_.step) / Fraction(p.grid_.unit)
    whole = rounded(inside @ multiples(p.weights_, bit), scale)
    limit = int(p.grid_.limit)
    units = np.clip(whole, -limit, limit)
    cut = (inside != steps).any(axis=1) | (units != whole).any(axis=1)
    return Projected(units, cut)


def coordinates(vectors, p, components):
    """(n, components) the first whole coordinates of vectors."""
    return projected(vectors, p).units[:, :components]


def unrounded(vectors, mean, weights):
    """(n, c) whole numbers proportional to (x - mean) @ weights, without any
    rounding."""
    bit = smallest_bit(np.concatenate([vectors.ravel(), mean]))
    d = multiples(vectors, bit) - multiples(mean, bit)
    return np.asarray(d @ multiples(weights, smallest_bit(weights)))


def nearest(rows, query, k):
    """The k nearest rows, equal distances in the order of the rows, and the squares of
    all."""
    squares = ((rows - query) ** 2).sum(axis=1).tolist()
    return sorted(range(len(rows)), key=lambda i: (squares[i], i))[:k], squares


def winner(labels):
    """The majority of the neighbours' labels, nearest first; ties to the nearest of the
    tied."""
    return max(labels, key=labels.count)


def root(square):
    """The root of a whole number, rounded once, by whole numbers alone."""
    digits = 64
    part = math.isqrt(square << 2 * digits)
    inexact = part * part != square << 2 * digits
    # Half a last digit more stands for all that was cut off.
    return float(Fraction(2 * part + inexact, 2 << digits))


def distance(square, unit):
    """The root of a whole number, rounded once, in units of a power of two."""
    return root(square) * unit


def least_root(apart, nearness):
    """The root of the least square of whole differences (n, c), times the nearness
    (n,), each rounded once."""
    squares = (apart**2).sum(axis=1).tolist()
    pairs = zip(squares, nearness.tolist(), strict=True)
    return math.sqrt(min(float(Fraction(square) * Fraction(n)) for square, n in pairs))


def doubt(space, point, vectors):
    """{name: (n,)} the outlier score and the distance to known objects of vectors at a
    decision point, by the rule of `train.model.outlier_score`."""
    at = space.points[point]
    steps = rounded((vectors - at.mean) * at.gain)
    steps = np.clip(steps, -int(CLIP * 2**STEP_BITS), int(CLIP * 2**STEP_BITS))
    inside = rounded(steps @ multiples(space.weights, 1.0), Fraction(2) ** -space.shift)
    squares = (steps**2).sum(axis=1) - (inside**2).sum(axis=1)
    whitening = multiples(at.whitening, 1.0)
    places = rounded(inside @ whitening, Fraction(2) ** -at.shift)
    places = np.clip(places, -int(FARTHEST), int(FARTHEST))
    rows = multiples(at.rows, 1.0)
    quarters = multiples(4.0 * at.weights, 1.0)
    outlier_score = []
    known_distance = []
    for outside, place in zip(squares.tolist(), places, strict=True):
        apart = rows - place
        closest = least_root(apart, at.nearness)
        outlier_score.append(float(Fraction(root(max(outside, 1))) * Fraction(closest)))
        # With weights in quarters, the root is four times as long.
        known_distance.append(least_root(apart * quarters, at.weighted_nearness) / 4.0)
    return {
        "outlier_score": np.array(outlier_score),
        "known_distance": np.array(known_distance),
    }


def outputs(fitted, X, y, vectors):
    """What a model is to answer to vectors, but for `doubt`.

    Args:
        fitted: a `ContactClassifier`.
        X: (trials, p) its training vectors.
        y: {task: their labels}.
        vectors: (n, p).
    """
    tasks = fitted.tasks_
    spaces = {
        space: projected(vectors[:, space.columns], space.projection)
        for space in {task.space for task in tasks.values()}
    }
    cut = np.any([of_space.cut for of_space in spaces.values()], axis=0)
    answers = {"out_of_range": cut.astype(np.float64)}
    for name, task in tasks.items():
        answers |= _outputs(name, task, X, y[name], spaces[task.space].units)
    return answers


def _outputs(name, task, X, y, points):
    """The outputs of a task, by the coordinates (n, c) of vectors."""
    members = np.flatnonzero(y != "")
    labels = y[members].tolist()
    classes = sorted(set(labels))
    space = task.space
    rows = coordinates(X[members][:, space.columns], space.projection, task.components)
    scale = Fraction(task.unit) * Fraction(task.slope)
    answers = []
    for query in points[:, : task.components]:
        near, squares = nearest(rows, query, task.k)
        votes = [labels[i] for i in near]
        answers.append(
            {
                "label": classes.index(winner(votes)),
                "scores": [float(Fraction(votes.count(c), task.k)) for c in classes],
                "distances": [distance(squares[i], task.unit) for i in near],
                "neighbours": members[near],
                "label_distances": [_far(c, labels, squares, scale) for c in classes],
            }
        )
    return {f"{name}_{end}": np.array([a[end] for a in answers]) for end in answers[0]}


def _far(label, labels, squares, scale):
    """The mean distance of a label's nearest twentieth, at least three, in log odds."""
    of_label = sorted(
        s for s, row_label in zip(squares, labels, strict=True) if row_label == label
    )
    count = min(len(of_label), max(-(-len(of_label) // 20), 3))
    wholes = [round(root(square)) for square in of_label[:count]]
    mean = float(Fraction(sum(wholes), count))
    return float(Fraction(mean) * Fraction(float(scale)))
