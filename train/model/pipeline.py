"""Nearest neighbours, and all tasks of a model together.

A fitted `ContactClassifier` finds the neighbours that its ONNX graph finds: coordinates
are whole numbers, and their squared distances are exact. `export/graph.py` writes the
graph down.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import compress
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.distance import cdist
from scipy.special import expit

from edge.arrays import Booleans, Floats, Integers
from edge.errors import InputError
from edge.model.agreement import agreed
from edge.touch.features import FEATURES
from train.data.vectors import Labels, Strings, Vectors, widths_of
from train.model.agreement import factors_of
from train.model.projection import Projection
from train.model.scaling import finite

NEAREST_OF_LABEL = 3
LABEL_SHARE = 20


def vote(labels: Integers) -> Integers:
    """(n,) majority of the neighbours' labels (n, k), nearest first.

    A tie goes to the nearest neighbour among the tied.
    """
    votes = (labels[:, :, None] == labels[:, None]).sum(axis=2)
    # The first, hence the nearest, of those with most votes.
    return np.take_along_axis(labels, votes.argmax(axis=1)[:, None], axis=1)[:, 0]


def squared_distances(X: Floats, rows: Floats) -> Floats:
    """(m, n) squared distances of points X (m, c) to rows (n, c); exact for those of a
    `Grid`."""
    if not X.shape[1]:
        return np.zeros((len(X), len(rows)))
    return np.asarray(cdist(X, rows, "sqeuclidean"))


def nearest_of_label(sizes: Integers) -> Integers:
    """Number of trials that stand for a label: a twentieth of its own, at least three.

    A label with fewer than three trials is represented by all of them. With a share
    rather than a number, a label's distance does not shrink as its trials become more.
    """
    return np.minimum(sizes, np.maximum(-(-sizes // LABEL_SHARE), NEAREST_OF_LABEL))


def label_distances(
    squares: Floats,
    labels: Integers,
    classes: int,
    unit: float,
) -> Floats:
    """(m, classes) distance of each label, from squared distances (m, n) to the trials.

    It is the mean distance of the label's nearest trials; `nearest_of_label` says of
    how many. Distances are rounded to the unit of the grid first. So their sum is a
    whole number of units far below 2^53, which every order of summation gives.
    """
    counts = nearest_of_label(np.bincount(labels, minlength=classes))
    out = np.empty((len(squares), classes))
    for label, count in enumerate(counts):
        nearest = np.sort(squares[:, labels == label], axis=1)[:, :count]
        wholes = np.rint(np.sqrt(nearest) / unit)
        out[:, label] = wholes.sum(axis=1) / count * unit
    return out


def slope(gaps: Floats) -> float:
    """By how much the log odds of being right change with the gap, without an
    intercept.

    The likelihood has one trial more at the mean size of a gap, half right and half
    wrong, so that it has a maximum.

    Args:
        gaps: (n,) how much nearer the right label is than any other; below 0 where it
            is not.

    Returns:
        Above 0; 1 without a gap.
    """
    size = float(np.abs(gaps).mean()) if gaps.any() else 0.0
    if size == 0.0:
        return 1.0
    x = gaps / size
    most = len(gaps) + 10.0

    def rise(change: float) -> float:
        return float((x * expit(-change * x)).sum() - 0.5 * np.tanh(0.5 * change))

    if rise(LEAST_SLOPE) <= 0.0:
        return LEAST_SLOPE / size
    return float(brentq(rise, LEAST_SLOPE, most)) / size


SLOPE_FOLDS = 3
"""Folds that measure how the odds of a label change with its distance."""
MOST_MEASURED = 1000
"""Of more trials, every second, third and so on is measured."""
LEAST_SLOPE = 1e-3
"""Smallest change of the log odds over the mean size of a gap."""
Space = tuple[object, ...]
"""The settings that two tasks must share to have one projection."""


@dataclass(frozen=True)
class Choice:
    """The settings that a task is fitted with.

    Attributes:
        scaling: one of `train.model.scaling.SCALINGS`.
        components: most coordinates.
        k: neighbours that vote.
        projection: one of `train.model.projection.KINDS`.
        shrinkage: of `lda`.
        features: names of those it takes; all where empty.
        targets: tasks whose discriminants `lda` sets side by side; the task itself
            where empty.
        weights: how often a simulated trial and one of the owner's count in scaling and
            projection, where there are both; 0 for trials that are not used at all.
    """

    scaling: str
    components: int
    k: int
    projection: str = "pca"
    shrinkage: float = 0.01
    features: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()
    weights: tuple[int, int] = (1, 1)

    def space(self, task: str) -> Space:
        """Tasks whose spaces are equal share a projection, with the components of the
        larger.

        So they do if they also lack the labels of the same trials.
        """
        space = (self.projection, self.scaling, self.features, self.weights)
        if self.projection == "pca":
            return space
        return (*space, self.shrinkage, self.targets or (task,))

    def counts(self, labels: Strings, is_own: Booleans | None = None) -> Integers:
        """(n,) how often each trial counts: 0 without a label, else by the weights.

        Args:
            labels: (n,) of the task; empty where a trial has none.
            is_own: (n,) whether a trial is the owner's; None where no weights are needed.
        """
        return how_often(labels != "", is_own, self.weights)


Choices = Mapping[str, Choice]
"""{task: its settings}."""


def how_often(
    labelled: Booleans,
    is_own: Booleans | None,
    weights: tuple[int, int],
) -> Integers:
    """(n,) how often each trial counts; see `Choice.counts`."""
    if is_own is None:
        return labelled.astype(np.int64)
    simulated, of_owner = weights
    return np.where(labelled, np.where(is_own, of_owner, simulated), 0)


def fittable(
    choices: Choices,
    y: Labels,
    is_own: Booleans | None,
) -> dict[str, Choice]:
    """The choices of the tasks that y has labels for, with k at most the number of
    their trials.

    Args:
        choices, y, is_own: see `ContactClassifier.fit`.
    """
    possible = {}
    for task, choice in choices.items():
        count = int(np.count_nonzero(choice.counts(y[task], is_own)))
        if count:
            possible[task] = replace(choice, k=min(choice.k, count))
    return possible


class Decided(NamedTuple):
    """A task's decisions on some vectors.

    Attributes:
        labels: (m,) indices.
        distances: (m, classes) of the nearest answer with each label, see
            `label_distances`, `ContactClassifier.slopes_` and `edge.model.agreement`.
    """

    labels: Integers
    distances: Floats


@dataclass(eq=False)
class ContactClassifier:
    """All tasks of a model: projection and neighbours of each, on the same trials.

    Args:
        choices: {task: Choice}.
        features: names of the feature types, in the order of the vectors.
        widths: columns of each; equal where None.

    Attributes:
        spaces_: {task: Space}.
        columns_: {space: the columns of the vectors that it takes, rising}.
        projections_: {space: Projection}, with the components of the task that has
            most.
        n_trials_: how many there are.
        members_: {space: (m,) the trials that it was fitted on, rising}.
        rows_: {space: (m, c)} these trials, projected.
        classes_: {task: sorted labels}; `labels_`: {task: (m,) class indices}.
        components_: {task: components kept}, at most as many as there are.
        slopes_: {task: by how much the log odds of a label change with its
            `label_distances`}.
        products_: {task: its factors} of the tasks decided together; see
            `edge.model.agreement`.
    """

    choices: Choices
    features: Sequence[str] = FEATURES
    widths: Sequence[int] | None = None

    @classmethod
    def of(
        cls,
        choices: Choices,
        vectors: Vectors,
        complete: bool = True,
    ) -> ContactClassifier:
        """A classifier fitted on some trials; see `fit`."""
        model = cls(choices, vectors.features, vectors.widths)
        return model.fit(vectors.X, vectors.y, vectors.is_own, complete)

    def fit(
        self,
        X: Floats,
        y: Labels,
        is_own: Booleans | None = None,
        complete: bool = True,
    ) -> ContactClassifier:
        """Fit every task on the trials of X (n, p) that have a label y[task] (n,) for
        it.

        Args:
            X, y: the trials; labels are empty where a trial has none.
            is_own: (n,) whether a trial is the owner's, see `Choice.counts`.
            complete: whether to set `slopes_` and `products_`, which `decide` needs.
        """
        X = finite(X)
        self.n_trials_, self.n_features_in_ = X.shape
        counts = self._set_spaces(y, is_own)
        self._fit_spaces(X, y, counts)
        self._set_labels(y)
        if complete:
            counting = {}
            for task, space in self.spaces_.items():
                counting[task] = np.where(counts[space] > 0, y[task], "")
            self.products_ = factors_of(counting)
            vectors = Vectors(X, y, self.features, self.widths, is_own)
            self.slopes_ = self._slopes(vectors)
        return self

    def _set_spaces(self, y: Labels, is_own: Booleans | None) -> dict[Space, Integers]:
        """Set `spaces_`; {space: (n,) how often each trial counts in it}."""
        self.spaces_: dict[str, Space] = {}
        counts: dict[Space, Integers] = {}
        for task, choice in self.choices.items():
            how_often = choice.counts(y[task], is_own)
            uneven = () if (how_often == 1).all() else how_often.tobytes()
            space = (*choice.space(task), uneven)
            self.spaces_[task] = space
            counts[space] = how_often
            n = np.count_nonzero(how_often)
            if not 1 <= choice.k <= n:
                raise InputError(f"k must be 1 to {n} training trials, not {choice.k}")
            if choice.components < 1:
                raise InputError(
                    f"components must be at least 1, not {choice.components}"
                )
        return counts

    def _fit_spaces(self, X: Floats, y: Labels, counts: dict[Space, Integers]) -> None:
        """Fit the projection of each space, and project its trials."""
        widths = widths_of(X.shape[1], self.features, self.widths)
        self.columns_: dict[Space, Integers] = {}
        self.projections_: dict[Space, Projection] = {}
        self.members_: dict[Space, Integers] = {}
        self.rows_: dict[Space, Floats] = {}
        for space, how_often in counts.items():
            tasks = [task for task in self.spaces_ if self.spaces_[task] == space]
            choice = self.choices[tasks[0]]
            names, named_widths = types_of(choice.features, self.features, widths)
            columns = columns_of(choice.features, self.features, widths)
            members = np.flatnonzero(how_often)
            # A trial that counts twice is there twice.
            rows = np.repeat(members, how_often[members])
            targets = [y[target][rows] for target in choice.targets or tasks[:1]]
            projection = Projection(
                choice.scaling,
                max(self.choices[task].components for task in tasks),
                names,
                choice.projection,
                choice.shrinkage,
                named_widths,
            )
            projection.fit(X[rows][:, columns], np.column_stack(targets))
            self.columns_[space] = columns
            self.projections_[space] = projection
            self.members_[space] = members
            self.rows_[space] = self.project(space, X[members])

    def _set_labels(self, y: Labels) -> None:
        """Set the labels and the coordinates of each task."""
        self.classes_: dict[str, Strings] = {}
        self.labels_: dict[str, Integers] = {}
        self.components_: dict[str, int] = {}
        for task, space in self.spaces_.items():
            labels = y[task][self.members_[space]]
            classes, indices = np.unique(labels, return_inverse=True)
            self.classes_[task] = classes
            self.labels_[task] = indices
            rank = self.projections_[space].rank_
            self.components_[task] = min(self.choices[task].components, rank)

    def _slopes(self, vectors: Vectors) -> dict[str, float]:
        """`slopes_`, from the distances of trials by fits without their fold.

        Distances between training trials would not do. Discriminants of many features
        with little shrinkage draw the trials of a label up to a hundred times closer
        together than new ones.
        """
        order = np.lexsort([vectors.y[task] for task in sorted(vectors.y)])
        vectors = vectors.part(order[:: -(-len(order) // MOST_MEASURED)])
        folds = np.arange(len(vectors.X)) % SLOPE_FOLDS
        gaps: dict[str, list[float]] = {task: [] for task in self.choices}
        for fold in range(SLOPE_FOLDS):
            new = folds == fold
            training = vectors.part(~new)
            choices = fittable(self.choices, training.y, training.is_own)
            model = ContactClassifier.of(choices, training, complete=False)
            for task, classes in model.classes_.items():
                labels = vectors.y[task]
                counting = self.choices[task].counts(labels, vectors.is_own) > 0
                tested = new & counting & np.isin(labels, classes)
                if len(classes) > 1:
                    gaps[task] += model._gaps(task, vectors.X[tested], labels[tested])
        return {task: slope(np.array(task_gaps)) for task, task_gaps in gaps.items()}

    def _gaps(self, task: str, X: Floats, labels: Strings) -> list[float]:
        """By how much nearer than any other the right label is to each of the vectors
        (m, p)."""
        distances = self._to_labels(task, self.squares(task, X))
        right = self.classes_[task].searchsorted(labels)[:, None]
        to_right = np.take_along_axis(distances, right, axis=1)[:, 0]
        np.put_along_axis(distances, right, np.inf, axis=1)
        gaps: list[float] = (distances.min(axis=1) - to_right).tolist()
        return gaps

    def _to_labels(self, task: str, squares: Floats) -> Floats:
        """(m, classes) `label_distances` of squares (m, members)."""
        classes = len(self.classes_[task])
        return label_distances(squares, self.labels_[task], classes, self.unit(task))

    def project(self, space: Space, X: Floats) -> Floats:
        """Coordinates (m, c) of vectors (m, p)."""
        return self.projections_[space].transform(X[:, self.columns_[space]])

    def squares(self, task: str, X: Floats) -> Floats:
        """(m, members) squared distances of vectors (m, p) to the trials of the task's
        space."""
        space = self.spaces_[task]
        c = self.components_[task]
        return squared_distances(
            self.project(space, X)[:, :c], self.rows_[space][:, :c]
        )

    def unit(self, task: str) -> float:
        """The unit of a task's coordinates, a power of two."""
        return self.projections_[self.spaces_[task]].grid_.unit

    def neighbours(self, task: str, X: Floats) -> tuple[Floats, Integers]:
        """Distances and training rows (m, k) for vectors (m, p), nearest first."""
        squares = self.squares(task, X)
        rows = self.nearest(task, squares)
        distances = np.sqrt(np.take_along_axis(squares, rows, axis=1))
        return distances, self.members_[self.spaces_[task]][rows]

    def nearest(self, task: str, squares: Floats) -> Integers:
        """(m, k) places of the smallest squares (m, members); of equal ones the
        first."""
        return np.argsort(squares, axis=1, kind="stable")[:, : self.choices[task].k]

    def decide(self, X: Floats) -> dict[str, Decided]:
        """{task: decisions} on vectors (m, p), as `edge.Model` makes them of the
        graph's votes."""
        labels = {}
        distances = {}
        for task, trial_labels in self.labels_.items():
            squares = self.squares(task, X)
            labels[task] = vote(trial_labels[self.nearest(task, squares)])
            distances[task] = self._to_labels(task, squares) * self.slopes_[task]
        for task, factors in self.products_.items():
            together, nearest_answers = agreed(task, factors, distances)
            labels |= together
            distances |= nearest_answers
        return {task: Decided(labels[task], distances[task]) for task in labels}


def columns_of(
    names: Collection[str],
    features: Sequence[str],
    widths: Sequence[int],
) -> Integers:
    """The columns of vectors of `features` that hold the `names` ones, rising; all if
    empty."""
    is_named = [not names or name in names for name in features]
    return np.flatnonzero(np.repeat(is_named, widths))


def types_of(
    names: Collection[str],
    features: Sequence[str],
    widths: Sequence[int],
) -> tuple[list[str], list[int]]:
    """Names and widths of the `names` among the features, in their order; all if
    empty."""
    is_named = [not names or name in names for name in features]
    return list(compress(features, is_named)), list(compress(widths, is_named))
