"""Settings that share a decomposition of features, and the neighbours that each of them
finds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from sklearn import config_context
from sklearn.neighbors import NearestNeighbors

from edge.arrays import Floats, Integers
from train.model.pipeline import Choice, squared_distances
from train.model.projection import Spectrum

COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20)
SHRINKAGES = (1.0, 0.3, 0.1, 0.03, 0.01, 0.003, 0.001, 0.0003)
NEIGHBOURS = (1, 2, 3, 4, 5, 7, 9)
MANY = 1 << 17
"""Distances from which on scikit-learn is faster."""


@dataclass(frozen=True)
class SearchGrid:
    """Candidates that share a decomposition of the features.

    Attributes:
        scaling: one of `train.model.scaling.SCALINGS`.
        projection: one of `train.model.projection.KINDS`.
        features: names of the features taken; all where empty.
        components: numbers of components, rising; `lda` takes all its directions.
        most_directions: of `lda`, those that separate best first; all where None.
        shrinkages: of `lda`, the largest first.
        neighbours: values of k, rising.
        targets: tasks whose discriminants `lda` sets side by side; the task itself
            where empty.
        tasks: the tasks it is a candidate for; all where empty.
        graded: answers count by their grades, see `train.choose.answers`.
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
    graded: bool = False

    def is_for(self, task: str) -> bool:
        """Whether these are candidates for a task."""
        return not self.tasks or task in self.tasks

    def choices(self, directions: int) -> list[Choice]:
        """Every candidate, in the order of `train.choose.answers`.

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
            )
            for c, s in cells
            for k in self.neighbours
        ]


Space = tuple[Floats, Floats]
"""Coordinates (n, c) of training rows, and (m, c) of those tested."""


def nearest(spaces: Sequence[Space], k: int) -> Integers:
    """(spaces, m, k) rows of training (n, c) nearest to each tested one (m, c), in each
    of some spaces of both; equal ones in their order.

    Which of several equal ones is the last of the k is left open. The coordinates are
    whole numbers, whose squared distances are exact. scikit-learn never holds all (m,
    n) of them and is fast for many, but it checks its input for longer than a few take.
    """
    training, tested = spaces[0]
    if len(training) * len(tested) > MANY:
        pairs = [_searched(*space, k) for space in spaces]
        squares, rows = map(np.stack, zip(*pairs, strict=True))
    else:
        squares = np.stack([_squares(*space) for space in spaces])
        rows = np.argpartition(squares, k - 1, axis=-1)[..., :k]
        squares = np.take_along_axis(squares, rows, axis=-1)
    order = np.lexsort((rows, squares), axis=-1)
    return np.take_along_axis(rows, order, axis=-1)


def clearness(spaces: Sequence[Space], labels: Integers, answers: Integers) -> Floats:
    """(spaces, m) how clearly the right label is nearest to each tested row, 0 to 1.

    It is 1 less the Brier score of a confidence that needs no calibration: the inverse
    square of the distance to the nearest row of the right label, over the sum of this
    and that of any other. Without a row of the right label it is 0.

    Args:
        spaces: with coordinates of the same rows.
        labels: (n,) class indices of the training rows.
        answers: (m,) the right ones.
    """
    same = answers[:, None] == labels
    squares = np.stack([squared_distances(new, rows) for rows, new in spaces])
    right = np.where(same, squares, np.inf).min(axis=2)
    other = np.where(same, np.inf, squares).min(axis=2)
    with np.errstate(invalid="ignore"):
        doubt = np.nan_to_num(right / (right + other), nan=1.0)
    return np.asarray(1.0 - doubt**2)


def _squares(training: Floats, tested: Floats) -> Floats:
    """(m, n) squared distances but for a constant of each tested row; where there are
    no coordinates, the order of the rows."""
    lengths = np.einsum("ij,ij->i", training, training)
    if not training.shape[1]:
        lengths = np.arange(len(training), dtype=np.float64)
    return np.asarray(lengths - 2.0 * (tested @ training.T))


def _searched(training: Floats, tested: Floats, k: int) -> tuple[Floats, Integers]:
    """(m, k) squared distances and rows, by scikit-learn."""
    if not training.shape[1]:
        rows = np.tile(np.arange(k), (len(tested), 1))
        return rows.astype(np.float64), rows
    search = NearestNeighbors(n_neighbors=k, algorithm="brute", metric="sqeuclidean")
    # Checks would take a quarter of the time.
    with config_context(assume_finite=True, skip_parameter_validation=True):
        squares, rows = search.fit(training).kneighbors(tested)
    return squares, rows


def _rounded(a: Floats, b: Floats) -> Space:
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

    The coordinates are those of `train.model.projection.Projection` but for its rounding of
    weights.

    Args:
        rows: (n, p) of training, scaled and centred.
        new: (m, p) others, scaled and centred alike.
        labels: {task: (n,) class indices} of the training rows.
    """

    def __init__(
        self,
        rows: Floats,
        new: Floats,
        labels: Mapping[str, Integers],
    ) -> None:
        self._spectrum = Spectrum(rows)
        self._new = new
        self._labels = labels
        self._along: dict[tuple[str, tuple[float, ...]], list[Space]] = {}

    def spaces(self, grid: SearchGrid, task: str) -> list[Space]:
        """[projection of a grid] the coordinates of training and new rows."""
        if grid.projection == "pca":
            axes = self._spectrum.leading(grid.components[-1]).T
            training, tested = _rounded(self._spectrum.rows @ axes, self._new @ axes)
            return [(training[:, :c], tested[:, :c]) for c in grid.components]
        by_target = [
            self._discriminants(target, grid.shrinkages)
            for target in grid.targets or (task,)
        ]
        spaces = []
        for coordinates in zip(*by_target, strict=True):
            rows, new = zip(*coordinates, strict=True)
            most = grid.most_directions
            spaces.append(_rounded(_beside(rows)[:, :most], _beside(new)[:, :most]))
        return spaces

    @cached_property
    def _new_scores(self) -> Floats:
        """Coordinates of the new rows along the eigenvectors."""
        return self._spectrum.scores_of(self._new)

    def _discriminants(
        self,
        task: str,
        shrinkages: tuple[float, ...],
    ) -> list[Space]:
        """[shrinkage] coordinates (n, c) and (m, c) along the discriminants of a
        task's labels."""
        if (task, shrinkages) not in self._along:
            spectrum = self._spectrum
            classes = spectrum.classes(self._labels[task])
            self._along[task, shrinkages] = [
                (spectrum.coordinates(along), self._new_scores @ along)
                for along in spectrum.directions(classes, shrinkages)
            ]
        return self._along[task, shrinkages]


def _beside(coordinates: Sequence[Floats]) -> Floats:
    """Coordinates (n, c) side by side; hstack copies a single one too."""
    return coordinates[0] if len(coordinates) == 1 else np.hstack(coordinates)
