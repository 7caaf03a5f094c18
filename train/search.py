"""Settings that share a decomposition of features, and the neighbours that each of them
finds."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from sklearn.neighbors import NearestNeighbors

from train.pipeline import Choice
from train.projection import Spectrum
from train.vectors import Floats, Integers

COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20)
SHRINKAGES = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003)
NEIGHBOURS = (1, 2, 3, 4, 5, 7, 9)
MANY = 1 << 17
"""Distances from which on scikit-learn is faster."""


@dataclass(frozen=True)
class SearchGrid:
    """Candidates that share a decomposition of the features.

    Attributes:
        scaling: one of `train.scaling.SCALINGS`.
        projection: one of `train.projection.KINDS`.
        features: names of the features taken; all where empty.
        components: numbers of components, rising; `lda` takes all its directions.
        most_directions: of `lda`, those that separate best first; all where None.
        shrinkages: of `lda`, the largest first.
        neighbours: values of k, rising.
        targets: tasks whose discriminants `lda` sets side by side; the task itself
            where empty.
        tasks: the tasks it is a candidate for; all where empty.
        weights: of simulated trials and the owner's, see `train.pipeline.Choice`.
    """

    scaling: str = "none"
    projection: str = "pca"
    features: tuple[str, ...] = ()
    components: tuple[int, ...] = COMPONENTS
    most_directions: int | None = None
    shrinkages: tuple[float, ...] = SHRINKAGES
    neighbours: tuple[int, ...] = NEIGHBOURS
    targets: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    weights: tuple[int, int] = (1, 1)

    def is_for(self, task: str) -> bool:
        """Whether these are candidates for a task."""
        return not self.tasks or task in self.tasks

    def choices(self, directions: int) -> list[Choice]:
        """Every candidate, in the order of `_answers`.

        Args:
            directions: how many discriminants there are at most.
        """
        if self.projection == "pca":
            cells = [(c, 0.01) for c in self.components]
        else:
            directions_kept = min(directions, self.most_directions or directions)
            cells = [(directions_kept, shrinkage) for shrinkage in self.shrinkages]
        return [
            Choice(
                self.scaling,
                c,
                k,
                self.projection,
                s,
                self.features,
                self.targets,
                self.weights,
            )
            for c, s in cells
            for k in self.neighbours
        ]


def _nearest(training: Floats, tested: Floats, k: int) -> Integers:
    """(m, k) rows of `training` (n, c) nearest to each of `tested` (m, c), equal ones in
    their order.

    Which of several equal ones is the last of the k is left open. The coordinates are
    whole numbers, whose squared distances are exact. scikit-learn never holds all (m,
    n) of them and is fast for many, but it checks its input for longer than a few take.
    """
    if not training.shape[1]:
        return np.tile(np.arange(k), (len(tested), 1))
    if len(training) * len(tested) > MANY:
        search = NearestNeighbors(
            n_neighbors=k, algorithm="brute", metric="sqeuclidean"
        ).fit(training)
        squares, rows = search.kneighbors(tested)
    else:
        squares = np.einsum("ij,ij->i", training, training) - 2.0 * (
            tested @ training.T
        )
        rows = np.argpartition(squares, k - 1, axis=1)[:, :k]
        squares = np.take_along_axis(squares, rows, axis=1)
    order = np.lexsort((rows, squares), axis=1)
    return np.take_along_axis(rows, order, axis=1)


def _rounded(a: Floats, b: Floats) -> tuple[Floats, Floats]:
    """Coordinates (n, c) and (m, c) in whole steps, so coarse that squared distances
    are exact.

    A step is 2^-22 of the largest coordinate, or a little more where c is above 128.
    Equal trials stay equal, though a matrix product may round their coordinates
    differently.
    """
    columns = max(a.shape[1], 1)
    bits = (51 - (columns - 1).bit_length()) // 2
    largest = max(np.abs(a).max(initial=0.0), np.abs(b).max(initial=0.0))
    _, exponent = np.frexp(largest)
    power = bits - exponent
    return np.rint(np.ldexp(a, power)), np.rint(np.ldexp(b, power))


class Decomposition:
    """Training rows and new ones along principal axes or discriminants, each computed
    once.

    The coordinates are those of `train.projection.Projection` but for its rounding of
    weights.

    Args:
        rows: (n, p) of training, scaled and centred; a trial that counts twice is there
            twice.
        new: (m, p) others, scaled and centred alike.
        labels: {task: (n,) class indices} of the training rows.
        first: (trials,) a row of each trial.
    """

    def __init__(
        self,
        rows: Floats,
        new: Floats,
        labels: Mapping[str, Integers],
        first: Integers,
    ) -> None:
        self._spectrum = Spectrum(rows)
        self._new = new
        self._labels = labels
        self._first = first
        self._new_scores: Floats | None = None
        self._along: dict[tuple[str, float], tuple[Floats, Floats]] = {}

    def neighbours(self, grid: SearchGrid, task: str) -> Integers:
        """(projections, m, k) places among the trials, for each projection of a
        grid."""
        k = min(grid.neighbours[-1], len(self._first))
        if grid.projection == "pca":
            axes = self._spectrum.leading(grid.components[-1]).T
            training, tested = _rounded(
                self._spectrum.rows[self._first] @ axes, self._new @ axes
            )
            return np.stack(
                [_nearest(training[:, :c], tested[:, :c], k) for c in grid.components]
            )
        places = []
        for shrinkage in grid.shrinkages:
            parts = [
                self._discriminants(target, shrinkage)
                for target in grid.targets or (task,)
            ]
            coordinates = (
                np.hstack(pair)[:, : grid.most_directions]
                for pair in zip(*parts, strict=True)
            )
            places.append(_nearest(*_rounded(*coordinates), k))
        return np.stack(places)

    def _discriminants(self, task: str, shrinkage: float) -> tuple[Floats, Floats]:
        """Coordinates (trials, c) and (m, c) along the discriminants of a task's
        labels."""
        if self._new_scores is None:
            self._new_scores = self._spectrum.scores_of(self._new)
        if (task, shrinkage) not in self._along:
            directions = self._spectrum.directions(self._labels[task], shrinkage)
            rows = (self._spectrum.scores @ directions)[self._first]
            self._along[task, shrinkage] = rows, self._new_scores @ directions
        return self._along[task, shrinkage]
