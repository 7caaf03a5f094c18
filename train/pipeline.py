"""Nearest neighbours, and all tasks of a model together.

A fitted `ContactClassifier` finds the neighbours that its ONNX graph finds: coordinates
are whole numbers, and their squared distances are exact. `export/graph.py` writes the
graph down.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.spatial.distance import cdist
from scipy.special import expit

from edge.errors import InputError
from edge.model.agreement import agreed
from edge.tools.teaching import nearest_of_label
from edge.touch.features import FEATURES
from train.agreement import Labels, factors_of
from train.projection import Projection
from train.scaling import finite, widths_of


def vote(labels: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) majority of the neighbours' labels (n, k), nearest first.

    A tie goes to the nearest neighbour among the tied.
    """
    votes = (labels[:, :, None] == labels[:, None]).sum(axis=2)
    # The first, hence the nearest, of those with most votes.
    return np.take_along_axis(labels, votes.argmax(axis=1)[:, None], axis=1)[:, 0]


def squared_distances(
    X: NDArray[np.float64], rows: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(m, n) squared distances of points X (m, c) to rows (n, c); exact for those of a
    `Grid`."""
    return (
        np.asarray(cdist(X, rows, "sqeuclidean"))
        if X.shape[1]
        else np.zeros((len(X), len(rows)))
    )


def label_distances(
    squares: NDArray[np.float64], labels: NDArray[np.int64], classes: int, unit: float
) -> NDArray[np.float64]:
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


def slope(gaps: NDArray[np.float64]) -> float:
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

    return (
        float(
            brentq(rise, LEAST_SLOPE, most) if rise(LEAST_SLOPE) > 0.0 else LEAST_SLOPE
        )
        / size
    )


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
        scaling: one of `train.scaling.SCALINGS`.
        components: most coordinates.
        k: neighbours that vote.
        projection: one of `train.projection.KINDS`.
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
        if self.projection == "pca":
            return self.projection, self.scaling, self.features, self.weights
        targets = self.targets or (task,)
        return (
            self.projection,
            self.scaling,
            self.features,
            self.weights,
            self.shrinkage,
            targets,
        )

    def counts(
        self, labels: NDArray[np.str_], is_own: NDArray[np.bool_] | None = None
    ) -> NDArray[np.int64]:
        """(n,) how often each trial counts: 0 without a label, else by the weights.

        Args:
            labels: (n,) of the task; empty where a trial has none.
            is_own: (n,) whether a trial is the owner's; None where no weights are needed.
        """
        counts = np.ones(len(labels), dtype=np.int64)
        if is_own is not None:
            counts = np.where(is_own, self.weights[1], self.weights[0])
        return np.where(labels == "", 0, counts)


def fittable(
    choices: Mapping[str, Choice], y: Labels, is_own: NDArray[np.bool_] | None
) -> dict[str, Choice]:
    """The choices of the tasks that y has labels for, with k at most the number of
    their trials.

    Args:
        choices, y, is_own: see `ContactClassifier.fit`.
    """
    counts = {
        task: int((c.counts(y[task], is_own) > 0).sum()) for task, c in choices.items()
    }
    return {
        t: replace(c, k=min(c.k, counts[t])) for t, c in choices.items() if counts[t]
    }


class Decided(NamedTuple):
    """A task's decisions on some vectors.

    Attributes:
        labels: (m,) indices.
        distances: (m, classes) of the nearest answer with each label, see
            `label_distances`, `ContactClassifier.slopes_` and `edge.model.agreement`.
    """

    labels: NDArray[np.int64]
    distances: NDArray[np.float64]


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

    def __init__(
        self,
        choices: Mapping[str, Choice],
        features: Sequence[str] = FEATURES,
        widths: Sequence[int] | None = None,
    ) -> None:
        self.choices = choices
        self.features = tuple(features)
        self.widths = widths

    def fit(
        self,
        X: NDArray[np.float64],
        y: Labels,
        is_own: NDArray[np.bool_] | None = None,
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
        self.spaces_: dict[str, Space] = {}
        counts: dict[Space, NDArray[np.int64]] = {}
        for task, choice in self.choices.items():
            each = choice.counts(y[task], is_own)
            space = (*choice.space(task), () if (each == 1).all() else each.tobytes())
            self.spaces_[task] = space
            counts[space] = each
            n = int((each > 0).sum())
            if not 1 <= choice.k <= n:
                raise InputError(f"k must be 1 to {n} training trials, not {choice.k}")
            if choice.components < 1:
                raise InputError(
                    f"components must be at least 1, not {choice.components}"
                )
        widths = widths_of(X.shape[1], self.features, self.widths)
        self.columns_ = {
            self.spaces_[task]: columns_of(choice.features, self.features, widths)
            for task, choice in self.choices.items()
        }
        self.projections_ = {
            space: self._projection(
                space, widths, X, y, np.repeat(np.arange(len(X)), each)
            )
            for space, each in counts.items()
        }
        self.members_ = {space: np.flatnonzero(each) for space, each in counts.items()}
        self.rows_ = {
            s: self.project(s, X[members]) for s, members in self.members_.items()
        }
        self.classes_: dict[str, NDArray[np.str_]] = {}
        self.labels_: dict[str, NDArray[np.int64]] = {}
        self.components_: dict[str, int] = {}
        for task, choice in self.choices.items():
            labels = y[task][self.members_[self.spaces_[task]]]
            self.classes_[task], self.labels_[task] = np.unique(
                labels, return_inverse=True
            )
            rank = self.projections_[self.spaces_[task]].rank_
            self.components_[task] = min(choice.components, rank)
        if complete:
            labels_used = {
                t: np.where(counts[space] > 0, y[t], "")
                for t, space in self.spaces_.items()
            }
            self.products_ = factors_of(labels_used)
            self.slopes_ = self._slopes(X, y, is_own)
        return self

    def _slopes(
        self, X: NDArray[np.float64], y: Labels, is_own: NDArray[np.bool_] | None
    ) -> dict[str, float]:
        """`slopes_`, from the distances of trials by fits without their fold.

        Distances between training trials would not do. Discriminants of many features
        with little shrinkage draw the trials of a label up to a hundred times closer
        together than new ones.
        """
        sample = np.lexsort([y[task] for task in sorted(y)])[
            :: -(-len(X) // MOST_MEASURED)
        ]
        X = X[sample]
        y = {task: labels[sample] for task, labels in y.items()}
        is_own = None if is_own is None else is_own[sample]
        folds = np.arange(len(X)) % SLOPE_FOLDS
        gaps: dict[str, list[float]] = {task: [] for task in self.choices}
        for fold in range(SLOPE_FOLDS):
            new = folds == fold
            known_labels = {task: labels[~new] for task, labels in y.items()}
            owned = None if is_own is None else is_own[~new]
            choices = fittable(self.choices, known_labels, owned)
            model = ContactClassifier(choices, self.features, self.widths)
            model.fit(X[~new], known_labels, owned, complete=False)
            for task, classes in model.classes_.items():
                used = self.choices[task].counts(y[task], is_own) > 0
                met = new & used & np.isin(y[task], classes)
                if len(classes) > 1:
                    squares = model.squares(task, X[met])
                    trial_labels = model.labels_[task]
                    unit = model.unit(task)
                    distances = label_distances(
                        squares, trial_labels, len(classes), unit
                    )
                    labels = classes.searchsorted(y[task][met])[:, None]
                    right = np.take_along_axis(distances, labels, axis=1)[:, 0]
                    np.put_along_axis(distances, labels, np.inf, axis=1)
                    gaps[task] += (distances.min(axis=1) - right).tolist()
        return {task: slope(np.array(task_gaps)) for task, task_gaps in gaps.items()}

    def _projection(
        self,
        space: Space,
        widths: Sequence[int],
        X: NDArray[np.float64],
        y: Labels,
        trials: NDArray[np.int64],
    ) -> Projection:
        """The projection of a space, fitted on some trials, of which one may be there
        often."""
        tasks = [
            task for task, task_space in self.spaces_.items() if task_space == space
        ]
        choice = self.choices[tasks[0]]
        names, own_widths = types_of(choice.features, self.features, widths)
        return Projection(
            choice.scaling,
            max(self.choices[task].components for task in tasks),
            names,
            choice.projection,
            choice.shrinkage,
            own_widths,
        ).fit(
            X[trials][:, self.columns_[space]],
            np.column_stack(
                [y[target][trials] for target in choice.targets or tasks[:1]]
            ),
        )

    def project(self, space: Space, X: NDArray[np.float64]) -> NDArray[np.float64]:
        """Coordinates (m, c) of vectors (m, p)."""
        return self.projections_[space].transform(X[:, self.columns_[space]])

    def squares(self, task: str, X: NDArray[np.float64]) -> NDArray[np.float64]:
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

    def neighbours(
        self, task: str, X: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """Distances and training rows (m, k) for vectors (m, p), nearest first."""
        squares = self.squares(task, X)
        rows = self.nearest(task, squares)
        distances = np.sqrt(np.take_along_axis(squares, rows, axis=1))
        return distances, self.members_[self.spaces_[task]][rows]

    def nearest(self, task: str, squares: NDArray[np.float64]) -> NDArray[np.int64]:
        """(m, k) places of the smallest squares (m, members); of equal ones the
        first."""
        return np.argsort(squares, axis=1, kind="stable")[:, : self.choices[task].k]

    def decide(self, X: NDArray[np.float64]) -> dict[str, Decided]:
        """{task: decisions} on vectors (m, p), as `edge.Model` makes them of the
        graph's votes."""
        labels = {}
        distances = {}
        for task, trial_labels in self.labels_.items():
            squares = self.squares(task, X)
            labels[task] = vote(trial_labels[self.nearest(task, squares)])
            classes = len(self.classes_[task])
            to_labels = label_distances(squares, trial_labels, classes, self.unit(task))
            distances[task] = to_labels * self.slopes_[task]
        for task, factors in self.products_.items():
            together, nearest_answers = agreed(task, factors, distances)
            labels |= together
            distances |= nearest_answers
        return {task: Decided(labels[task], distances[task]) for task in labels}


def columns_of(
    names: Sequence[str], features: Sequence[str], widths: Sequence[int]
) -> NDArray[np.int64]:
    """The columns of vectors of `features` that hold the `names` ones, rising; all if
    empty."""
    is_named = [not names or name in names for name in features]
    return np.flatnonzero(np.repeat(is_named, widths))


def types_of(
    names: Sequence[str], features: Sequence[str], widths: Sequence[int]
) -> tuple[list[str], list[int]]:
    """Names and widths of the `names` among the features, in their order; all if
    empty."""
    pairs = [
        (f, w) for f, w in zip(features, widths, strict=True) if not names or f in names
    ]
    return [name for name, _ in pairs], [width for _, width in pairs]
