"""Nearest neighbours, and all tasks of a model together.

A fitted `ContactClassifier` finds the neighbours that its ONNX graph finds: coordinates
are whole numbers, and their squared distances are exact. `export/graph.py` writes the
graph down.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.spatial.distance import cdist
from scipy.special import expit

from edge.arrays import Floats, Integers
from edge.decide.agreement import agreed
from edge.errors import InputError
from edge.features.vector import FEATURES
from train.data.vectors import Labels, Strings, Vectors, blocks
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
    Of prototypes, which do not become more, the nearest alone stands for a label.
    """
    return np.minimum(sizes, np.maximum(-(-sizes // LABEL_SHARE), NEAREST_OF_LABEL))


def label_distances(
    squares: Floats,
    labels: Integers,
    counts: Integers,
    unit: float,
) -> Floats:
    """(m, classes) distance of each label, from squared distances (m, n) to the rows.

    It is the mean distance of so many of the label's nearest rows. Distances are
    rounded to the unit of the grid first. So their sum is a whole number of units far
    below 2^53, which every order of summation gives.
    """
    out = np.empty((len(squares), len(counts)))
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
    """

    scaling: str
    components: int
    k: int
    projection: str = "pca"
    shrinkage: float = 0.01
    features: tuple[str, ...] = ()
    targets: tuple[str, ...] = ()

    def space(self, task: str) -> Space:
        """Tasks whose spaces are equal share a projection, with the components of the
        larger.

        So they do if they also lack the labels of the same trials.
        """
        space = (self.projection, self.scaling, self.features)
        if self.projection == "pca":
            return space
        return (*space, self.shrinkage, self.targets or (task,))


Choices = Mapping[str, Choice]
"""{task: its settings}."""
Slopes = Mapping[tuple[str, Choice], float]
"""{(task, its settings with 1 neighbour): `FittedTask.slope`}, of which the number of
neighbours is no part."""


def fittable(choices: Choices, y: Labels) -> dict[str, Choice]:
    """The choices of the tasks that y has labels for, with k at most the number of
    their trials."""
    possible = {}
    for task, choice in choices.items():
        count = int(np.count_nonzero(y[task]))
        if count:
            possible[task] = replace(choice, k=min(choice.k, count))
    return possible


class TaskAnswers(NamedTuple):
    """A task's decisions on some vectors.

    Attributes:
        labels: (m,) indices.
        distances: (m, classes) of the nearest answer with each label, see
            `label_distances`, `FittedTask.slope` and `edge.decide.agreement`.
    """

    labels: Integers
    distances: Floats


@dataclass(frozen=True, eq=False)
class FittedSpace:
    """A projection of the vectors, with the rows that tasks compare in it.

    Attributes:
        columns: of the vectors, that it takes, rising.
        projection: with the components of the task that has most.
        members: (m,) numbers of the rows among those of a model, rising: the trials
            that it was fitted on, or their prototypes.
        trials: (m,) the trial next to each row.
        rows: (m, c) these trials, projected, or the means of the prototypes' trials.
    """

    columns: Integers
    projection: Projection
    members: Integers
    trials: Integers
    rows: Floats

    def project(self, X: Floats) -> Floats:
        """Coordinates (n, c) of vectors (n, p)."""
        return self.projection.transform(X, self.columns)


@dataclass(frozen=True, eq=False)
class FittedTask:
    """A task's labels in its space.

    Attributes:
        space: that tasks of equal settings share.
        classes: the labels, sorted.
        labels: (m,) class indices of the space's rows.
        counts: (classes,) rows that stand for a label, see `nearest_of_label`.
        components: coordinates that count, at most as many as the space has.
        k: neighbours that vote.
        slope: by how much the log odds of a label change with its `label_distances`.
    """

    space: FittedSpace
    classes: Strings
    labels: Integers
    counts: Integers
    components: int
    k: int
    slope: float = 1.0

    @property
    def unit(self) -> float:
        """The unit of the coordinates, a power of two."""
        return self.space.projection.grid_.unit

    @property
    def rows(self) -> Floats:
        """(m, components) the coordinates of the space's rows."""
        return self.space.rows[:, : self.components]

    def squares(self, X: Floats) -> Floats:
        """(n, m) squared distances of vectors (n, p) to the space's rows."""
        return squared_distances(self.space.project(X)[:, : self.components], self.rows)

    def nearest(self, squares: Floats) -> Integers:
        """(n, k) places of the smallest squares (n, m); of equal ones the first."""
        last = np.partition(squares, self.k - 1, axis=1)[:, self.k - 1, None]
        near = squares <= last
        if near.sum() > len(squares) * self.k:  # several are as far as the last one
            return np.argsort(squares, axis=1, kind="stable")[:, : self.k]
        places = np.nonzero(near)[1].reshape(-1, self.k)
        smallest = np.take_along_axis(squares, places, axis=1)
        order = np.argsort(smallest, axis=1, kind="stable")
        return np.take_along_axis(places, order, axis=1)

    def neighbours(self, X: Floats) -> tuple[Floats, Integers]:
        """Distances and rows of the model (n, k) for vectors (n, p), nearest first."""
        squares = self.squares(X)
        places = self.nearest(squares)
        distances = np.sqrt(np.take_along_axis(squares, places, axis=1))
        return distances, self.space.members[places]

    def to_labels(self, squares: Floats) -> Floats:
        """(n, classes) `label_distances` of squares (n, m)."""
        return label_distances(squares, self.labels, self.counts, self.unit)

    def gaps(self, X: Floats, labels: Strings) -> Floats:
        """(n,) by how much nearer than any other the right label is to each of the
        vectors (n, p)."""
        distances = self.to_labels(self.squares(X))
        right = self.classes.searchsorted(labels)[:, None]
        to_right = np.take_along_axis(distances, right, axis=1)[:, 0]
        np.put_along_axis(distances, right, np.inf, axis=1)
        return np.asarray(distances.min(axis=1) - to_right)


Fits = dict[tuple[tuple[str, Choice], ...], dict[str, FittedTask]]
"""{tasks that share a space, with their settings: {task: its fit}}."""


@dataclass(eq=False)
class ContactClassifier:
    """All tasks of a model: projection and neighbours of each, on the same trials.

    Args:
        choices: {task: Choice}.
        features: names of the feature types, in the order of the vectors.
        widths: columns of each; equal where None.

    Attributes:
        n_rows_: how many rows it compares with.
        tasks_: {task: FittedTask}.
        products_: {task: its factors} of the tasks decided together; see
            `edge.decide.agreement`.
    """

    choices: Choices
    features: Sequence[str] = FEATURES
    widths: Sequence[int] | None = None

    @classmethod
    def of(
        cls,
        choices: Choices,
        vectors: Vectors,
        fits: Fits | None = None,
        slopes: Slopes | None = None,
    ) -> ContactClassifier:
        """A classifier fitted on some trials.

        Args:
            choices: {task: Choice}.
            vectors: the trials; labels are empty where a trial has none.
            fits: on the same trials, which are taken, and added to.
            slopes: of these settings; those that the trials give where None.
        """
        model = cls(choices, vectors.features, vectors.widths)
        return model._fit(vectors, {} if fits is None else fits, slopes)

    def fit(self, X: Floats, y: Labels) -> ContactClassifier:
        """Fit every task on the trials of X (n, p) that have a label y[task] (n,) for
        it.

        Args:
            X, y: the trials; labels are empty where a trial has none.
        """
        return self._fit(Vectors(X, y, self.features, self.widths), {})

    def _fit(
        self, vectors: Vectors, fits: Fits, slopes: Slopes | None = None
    ) -> ContactClassifier:
        """Fit the tasks that have no fit yet."""
        vectors = replace(vectors, X=finite(vectors.X))
        if slopes is None:
            slopes = slopes_of([self.choices], vectors)
        self.n_rows_, self.n_features_in_ = vectors.X.shape
        if vectors.prototypes is not None:
            self.n_rows_ = int(vectors.prototypes.max()) + 1
        fitted: dict[str, FittedTask] = {}
        for choices in sharing_a_space(self.choices, vectors):
            key = tuple(choices.items())
            if key not in fits:
                fits[key] = fit_together(choices, vectors)
            fitted |= with_prototypes(fits[key], vectors)
        self.tasks_ = {
            task: replace(fitted[task], slope=slopes[task, replace(choice, k=1)])
            for task, choice in self.choices.items()
        }
        self.joint_tasks_ = factors_of({task: vectors.y[task] for task in self.choices})
        return self

    @property
    def trials_(self) -> Integers:
        """(rows,) the training trial next to each row, by the task that has most
        labels."""
        trials = np.zeros(self.n_rows_, dtype=np.int64)
        for fitted in sorted(self.tasks_.values(), key=lambda fit: len(fit.classes)):
            trials[fitted.space.members] = fitted.space.trials
        return trials

    def decide(self, X: Floats) -> dict[str, TaskAnswers]:
        """{task: decisions} on vectors (m, p), as `edge.Model` makes them of the
        graph's votes."""
        labels = {}
        distances = {}
        for task, fitted in self.tasks_.items():
            by_block = []
            for block in blocks(X, self.n_rows_):
                squares = fitted.squares(block)
                voted = vote(fitted.labels[fitted.nearest(squares)])
                by_block.append((voted, fitted.to_labels(squares) * fitted.slope))
            labels[task], distances[task] = map(
                np.concatenate, zip(*by_block, strict=True)
            )
        for task, factors in self.joint_tasks_.items():
            together, nearest_answers = agreed(task, factors, distances)
            labels |= together
            distances |= nearest_answers
        return {task: TaskAnswers(labels[task], distances[task]) for task in labels}


def sharing_a_space(choices: Choices, vectors: Vectors) -> list[dict[str, Choice]]:
    """The choices of each space: tasks share one of equal settings and trials.

    Raises:
        InputError: a choice asks for more neighbours than there are trials, or for no
            component.
    """
    spaces: dict[tuple[object, ...], dict[str, Choice]] = {}
    for task, choice in choices.items():
        labelled = vectors.y[task] != ""
        n = np.count_nonzero(labelled)
        if not 1 <= choice.k <= n:
            raise InputError(f"k must be 1 to {n} training trials, not {choice.k}")
        if choice.components < 1:
            raise InputError(f"components must be at least 1, not {choice.components}")
        key = (choice.space(task), labelled.tobytes())
        spaces.setdefault(key, {})[task] = choice
    return list(spaces.values())


def fit_together(choices: Choices, vectors: Vectors) -> dict[str, FittedTask]:
    """Fit tasks that share a space on the trials that have labels for them."""
    features = next(iter(choices.values())).features
    columns = vectors.columns_of(features)
    fitted = _fit_space(choices, vectors.of(features))
    space = replace(next(iter(fitted.values())).space, columns=columns)
    return {task: replace(fit, space=space) for task, fit in fitted.items()}


def _fit_space(choices: Choices, vectors: Vectors) -> dict[str, FittedTask]:
    """The tasks in the space that they share, which takes all columns."""
    task, choice = next(iter(choices.items()))
    members = np.flatnonzero(vectors.y[task])
    targets = [vectors.y[target][members] for target in choice.targets or (task,)]
    projection = Projection(
        choice.scaling,
        max(choice.components for choice in choices.values()),
        vectors.features,
        choice.projection,
        choice.shrinkage,
        vectors.columns,
    )
    # A copy of all trials would take as much memory as they do.
    X = vectors.X if len(members) == vectors.trials else vectors.X[members]
    projection.fit(X, np.column_stack(targets))
    columns = np.arange(X.shape[1])
    projected = projection.transform(X)
    space = FittedSpace(columns, projection, members, members, projected)
    fitted = {}
    for task, choice in choices.items():
        classes, labels = np.unique(vectors.y[task][members], return_inverse=True)
        components = min(choice.components, projection.rank_)
        counts = nearest_of_label(np.bincount(labels))
        fitted[task] = FittedTask(space, classes, labels, counts, components, choice.k)
    return fitted


def with_prototypes(
    fitted: Mapping[str, FittedTask], vectors: Vectors
) -> dict[str, FittedTask]:
    """Tasks that share a space, with the prototypes of the vectors as its rows, where
    they have some."""
    if vectors.prototypes is None:
        return {**fitted}
    space = next(iter(fitted.values())).space
    of_trials = vectors.prototypes[space.members]
    members, first, places = np.unique(
        of_trials, return_index=True, return_inverse=True
    )
    unit = space.projection.grid_.unit
    sums = [np.bincount(places, column / unit) for column in space.rows.T]
    means = np.reshape(sums, (-1, len(members))).T / np.bincount(places)[:, None]
    rows = np.rint(means) * unit
    away = ((space.rows - rows[places]) ** 2).sum(axis=1)
    order = np.lexsort((away, places))
    nearest = order[np.searchsorted(places[order], np.arange(len(members)))]
    trials = space.members[nearest]
    condensed = replace(space, members=members, trials=trials, rows=rows)
    return {
        task: replace(
            fit,
            space=condensed,
            labels=fit.labels[first],
            counts=np.ones_like(fit.counts),
        )
        for task, fit in fitted.items()
    }


def slopes_of(settings: Iterable[Choices], vectors: Vectors) -> Slopes:
    """The slopes of several settings of the tasks, by trials (n, p)."""
    slopes: dict[tuple[str, Choice], float] = {}
    for choices in settings:
        single = {task: replace(choice, k=1) for task, choice in choices.items()}
        new = {task: c for task, c in single.items() if (task, c) not in slopes}
        for together in sharing_a_space(new, vectors):
            features = next(iter(together.values())).features
            measured = _slopes(together, vectors.of(features))
            slopes |= {(task, new[task]): value for task, value in measured.items()}
    return slopes


def _slopes(choices: Choices, vectors: Vectors) -> dict[str, float]:
    """{task: its slope} of tasks that share a space, from the distances of trials by
    fits without their fold.

    Distances between training trials would not do. Discriminants of many features with
    little shrinkage draw the trials of a label up to a hundred times closer together
    than new ones.
    """
    order = np.lexsort([vectors.y[task] for task in sorted(vectors.y)])
    vectors = vectors.part(order[:: -(-len(order) // MOST_MEASURED)])
    folds = np.arange(len(vectors.X)) % SLOPE_FOLDS
    gaps = {task: [np.zeros(0)] for task in choices}
    for fold in range(SLOPE_FOLDS):
        left_out = folds == fold
        training = vectors.part(~left_out)
        possible = fittable(choices, training.y)
        if not possible:
            continue
        fits = with_prototypes(_fit_space(possible, training), training)
        for task, fitted in fits.items():
            labels = vectors.y[task]
            tested = left_out & np.isin(labels, fitted.classes)
            if len(fitted.classes) > 1:
                gaps[task].append(fitted.gaps(vectors.X[tested], labels[tested]))
    return {task: slope(np.concatenate(of_folds)) for task, of_folds in gaps.items()}
