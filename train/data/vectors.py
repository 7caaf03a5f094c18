"""Feature vectors of trials, with their labels."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import compress, pairwise
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Floats, Integers
from edge.errors import InputError
from edge.features.vector import FEATURES

Strings = NDArray[np.str_]

MOST_ROWS = 500
"""Trials that are the rows of a model themselves; of more, few rows stand for all."""
BLOCK = 1 << 19
"""Entries of a matrix that is made at once, few enough for a processor's cache."""
Labels = Mapping[str, Strings]
"""{task: (n,) labels}; empty where a trial has none, which then does not count."""


def widths_of(
    columns: int,
    features: Sequence[str],
    widths: Sequence[int] | None = None,
) -> tuple[int, ...]:
    """How many of so many columns each feature type has: `widths`, or an equal share.

    Raises:
        InputError: the columns are no whole number of samples a feature.
    """
    if widths is None:
        if columns % len(features):
            raise InputError(
                f"{columns} columns are no whole number of samples of {len(features)} "
                "features"
            )
        return (columns // len(features),) * len(features)
    if len(widths) != len(features) or sum(widths) != columns:
        raise InputError(f"{columns} columns are not those of {len(features)} features")
    return tuple(widths)


def blocks(rows: NDArray[Any], others: int) -> list[NDArray[Any]]:
    """Rows in blocks, whose matrices with so many others take little memory."""
    return np.array_split(rows, 1 + len(rows) * others // BLOCK)


def column_parts(X: Floats) -> list[slice]:
    """The columns of X (n, p) in parts, whose matrices take little memory."""
    edges = np.linspace(0, X.shape[1], 2 + X.size // BLOCK).astype(int)
    return [slice(*ends) for ends in pairwise(edges.tolist())]


@dataclass(frozen=True)
class Vectors:
    """Feature vectors of n trials, and what they are.

    Attributes:
        X: (n, p), or (decision points, n, p).
        y: {task: (n,) labels}.
        features: names of the feature types, in the order of X.
        widths: columns of each; equal where None.
        prototypes: (n,) the number of each trial's prototype; None where each trial is
            a row of a model itself.
    """

    X: Floats = field(repr=False)
    y: Labels = field(repr=False)
    features: Sequence[str] = FEATURES
    widths: Sequence[int] | None = None
    prototypes: Integers | None = field(default=None, repr=False)

    @property
    def trials(self) -> int:
        """Number of trials."""
        return int(self.X.shape[-2])

    @property
    def columns(self) -> tuple[int, ...]:
        """Number of columns of each feature type."""
        return widths_of(self.X.shape[-1], self.features, self.widths)

    def columns_of(self, names: Collection[str]) -> Integers:
        """The columns of the features with these names, rising; all if empty."""
        is_named = [not names or name in names for name in self.features]
        return np.flatnonzero(np.repeat(is_named, self.columns))

    def of(self, names: Collection[str]) -> Self:
        """The same trials with the features with these names; all if empty."""
        is_named = [not names or name in names for name in self.features]
        if all(is_named):
            return self
        columns = self.columns_of(names)
        X = self.X[..., columns[0] : columns[-1] + 1]
        # A copy would leave the file that the vectors may be in.
        if X.shape[-1] > len(columns):
            X = np.ascontiguousarray(self.X[..., columns])
        return replace(
            self,
            X=X,
            features=tuple(compress(self.features, is_named)),
            widths=tuple(compress(self.columns, is_named)),
        )

    def part(self, trials: NDArray[Any] | slice) -> Self:
        """Some of the trials, by a mask (n,), by their numbers or by a slice."""
        return replace(
            self,
            X=self.X[..., trials, :],
            y={task: labels[trials] for task, labels in self.y.items()},
            prototypes=None if self.prototypes is None else self.prototypes[trials],
        )
