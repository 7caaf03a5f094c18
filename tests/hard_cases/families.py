"""Families of small training sets made to be hard, each set by a seed; see `adversarial.py`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.hard_cases.models import Array
from train.pipeline import Choice

WIDTH = 24
"""Columns of a vector: eight samples of three features."""
QUERIES = 8


@dataclass(frozen=True)
class Hard:
    """A training set, its labels, queries, and how the model is fitted."""

    X: Array
    y: NDArray[np.int64]
    queries: Array
    choice: Choice


def typical(draw: np.random.Generator, n: int) -> Array:
    """Vectors with the scales of force, area and motion."""
    X = draw.gamma(2.0, size=(n, WIDTH))
    X[:, 8:16] *= 30.0
    X[:, 16:] *= 0.02
    return X


def choice(draw: np.random.Generator, n: int, scaling: str = "none", **more: Any) -> Choice:
    """Components and neighbours by chance, even numbers of neighbours more often."""
    k = int(draw.choice([1, 2, 2, 3, 4, 4, 6, 8]))
    return Choice(scaling, int(draw.integers(1, 21)), min(k, n), **more)


def labels(draw: np.random.Generator, n: int) -> NDArray[np.int64]:
    """Labels that have nothing to do with the rows: votes tie, and each order gives another."""
    return draw.integers(0, draw.integers(2, 6), n)


def contacts(draw: np.random.Generator) -> Hard:
    """Ordinary vectors, every scaling."""
    n = int(draw.integers(8, 60))
    scaling = str(draw.choice(["none", "I", "II", "III", "IV", "V"]))
    X = typical(draw, n)
    return Hard(X, labels(draw, n), typical(draw, QUERIES), choice(draw, n, scaling))


def lattices(draw: np.random.Generator) -> Hard:
    """Whole numbers in a few columns, queries on and between them: exact ties everywhere."""
    half, used = int(draw.integers(4, 30)), int(draw.integers(1, 5))
    columns = draw.choice(WIDTH, used, replace=False)
    X, queries = np.zeros((2 * half, WIDTH)), np.zeros((QUERIES, WIDTH))
    points = draw.integers(-3, 4, (half, used)) * 2.0 ** draw.integers(-8, 9)
    X[:, columns] = np.concatenate([points, -points])  # the mean is exactly 0
    queries[:, columns] = X[draw.integers(0, 2 * half, QUERIES)][:, columns]
    queries[::2, columns] += points[draw.integers(0, half, len(queries[::2]))]
    queries *= 0.5
    return Hard(X, labels(draw, 2 * half), queries, choice(draw, 2 * half))


def duplicates(draw: np.random.Generator) -> Hard:
    """Rows that stand several times in the set, under different labels."""
    few, times = int(draw.integers(2, 10)), int(draw.integers(2, 6))
    X = np.repeat(typical(draw, few), times, axis=0)[draw.permutation(few * times)]
    queries = X[draw.integers(0, len(X), QUERIES)].copy()
    queries[::2] *= 1.0 + 1e-3 * draw.normal(size=(len(queries[::2]), 1))
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, len(X)), queries, choice(draw, len(X), scaling))


def near_duplicates(draw: np.random.Generator) -> Hard:
    """Rows that differ in a part of 1e-1 to 1e-15 of themselves."""
    n, base = int(draw.integers(8, 40)), typical(draw, 3)
    spread = 10.0 ** -draw.uniform(1.0, 15.0)
    X = base[draw.integers(0, 3, n)] * (1.0 + spread * draw.normal(size=(n, WIDTH)))
    queries = base[draw.integers(0, 3, QUERIES)] * (
        1.0 + spread * draw.normal(size=(QUERIES, WIDTH))
    )
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, n), queries, choice(draw, n, scaling))


def offsets(draw: np.random.Generator) -> Hard:
    """A spread of 1 far from zero, up to 1e12."""
    n = int(draw.integers(8, 40))
    offset = draw.choice([-1.0, 1.0], WIDTH) * 10.0 ** draw.uniform(0.0, 12.0)
    X = offset + draw.normal(size=(n, WIDTH))
    scaling = str(draw.choice(["none", "III"]))
    return Hard(
        X, labels(draw, n), offset + draw.normal(size=(QUERIES, WIDTH)), choice(draw, n, scaling)
    )


def scales(draw: np.random.Generator) -> Hard:
    """From 1e-25 to 1e25, and columns up to ten decades apart."""
    n = int(draw.integers(8, 40))
    size = 10.0 ** (draw.uniform(-25.0, 25.0) + draw.uniform(-5.0, 5.0, WIDTH))
    X = draw.normal(size=(n, WIDTH)) * size
    return Hard(X, labels(draw, n), draw.normal(size=(QUERIES, WIDTH)) * size, choice(draw, n))


def discriminants(draw: np.random.Generator) -> Hard:
    """Classes told apart by a projection that is made for them, with ties of equal rows."""
    n = int(draw.integers(20, 60))
    y = np.arange(n) % int(draw.integers(2, 6))
    X = typical(draw, n) + 3.0 * typical(draw, int(y.max()) + 1)[y]
    X[draw.integers(0, n)] = X[draw.integers(0, n)]
    queries = np.concatenate([X[:4], X[4:8] + 1e-9 * draw.normal(size=(4, WIDTH))])
    shrinkage = float(10.0 ** -draw.uniform(0.0, 4.0))
    more = {"projection": "lda", "shrinkage": shrinkage}
    return Hard(X, y, queries, choice(draw, n, "III", **more))


def outside(draw: np.random.Generator) -> Hard:
    """Queries 1 to 1e12 times outside the training set, whose rows nearly repeat."""
    hard = near_duplicates(draw)
    away = 10.0 ** draw.uniform(0.0, 12.0, (QUERIES, 1))
    return replace(hard, queries=hard.queries + away * typical(draw, QUERIES))


def columns(draw: np.random.Generator) -> Hard:
    """Up to 600 values a trial."""
    n, width = int(draw.integers(8, 14)), 3 * int(draw.integers(30, 200))
    X = draw.gamma(2.0, size=(n, width)) * (1.0 + draw.choice([0.0, 1e9]))
    X[1::2] = X[::2][: n // 2] * (1.0 + 10.0 ** -draw.uniform(1.0, 15.0))
    c = Choice("none", int(draw.integers(1, 5)), int(draw.integers(1, 5)))
    return Hard(X, labels(draw, n), 0.5 * (X[:4] + X[4:8]), c)


def dominated(draw: np.random.Generator) -> Hard:
    """One feature 1e3 to 1e16 times as large as the others, which alone tell the rows apart."""
    n = int(draw.integers(8, 40))
    X = typical(draw, n)
    X[:, :8] = np.rint(2.0 * draw.uniform(size=(n, 8))) * 10.0 ** draw.uniform(3.0, 16.0)
    queries = X[draw.integers(0, n, QUERIES)]
    away = 10.0 ** -draw.uniform(0.0, 12.0)
    queries[:, 8:] *= 1.0 + away * draw.normal(size=(QUERIES, WIDTH - 8))
    scaling = str(draw.choice(["none", "III", "V"]))
    return Hard(X, labels(draw, n), queries, choice(draw, n, scaling))


def denormals(draw: np.random.Generator) -> Hard:
    """Columns of a few of the smallest numbers that there are, beside ordinary ones."""
    n = int(draw.integers(8, 40))
    X, small = typical(draw, n), draw.random(WIDTH) < 0.6
    few = draw.integers(0, 50, (n, int(small.sum()))) * 2.0 ** draw.integers(0, 30)
    X[:, small] = few * float(np.finfo(np.float64).smallest_subnormal)
    queries = X[draw.integers(0, n, QUERIES)]
    queries[::2] = typical(draw, len(queries[::2]))
    scaling = str(draw.choice(["none", "III", "IV"]))
    return Hard(X, labels(draw, n), queries, choice(draw, n, scaling))


FAMILIES: dict[str, Callable[[np.random.Generator], Hard]] = {
    family.__name__: family
    for family in (
        contacts, lattices, duplicates, near_duplicates, offsets, scales, discriminants, outside,
        columns, dominated, denormals,
    )
}  # fmt: skip


def made(family: str, seed: int) -> Hard:
    """A set of a family."""
    return FAMILIES[family](np.random.default_rng([list(FAMILIES).index(family), seed]))
