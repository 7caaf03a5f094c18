"""The answers of all candidates to the trials that a fit leaves out."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Booleans, Integers
from train.choose.search import (
    Decomposition,
    SearchGrid,
    Space,
    clearness,
    nearest,
)
from train.data.vectors import Vectors
from train.model.scaling import centred_and_scaled
from train.threads import single_thread

RIGHT = 0.51
"""Grade of a right answer, however near another label is."""


@dataclass(frozen=True)
class _Fit:
    """Trials that candidates are fitted on, and those that they answer.

    Attributes:
        vectors: of all trials.
        classes: {task: (n,) class indices, -1 for a trial without a label}.
        train, test: the trials.
    """

    vectors: Vectors
    classes: Mapping[str, Integers]
    train: Integers
    test: Integers

    def labelled(self, grid: SearchGrid) -> list[tuple[list[str], Integers]]:
        """A grid's tasks, by the `train` trials that have labels for them."""
        by_trials: dict[bytes, tuple[list[str], Integers]] = {}
        for task, labels in self.classes.items():
            if grid.is_for(task):
                trials = self.train[labels[self.train] >= 0]
                tasks, _ = by_trials.setdefault(trials.tobytes(), ([], trials))
                tasks.append(task)
        return list(by_trials.values())

    def decomposition(self, grid: SearchGrid, rows: Integers) -> Decomposition:
        """The scaled vectors of a grid's features, fitted on some trials."""
        vectors = self.vectors.of(grid.features)
        mean, gain, scaled = centred_and_scaled(
            vectors.X[rows],
            grid.scaling,
            vectors.features,
            vectors.columns,
        )
        labels_of = {task: labels[rows] for task, labels in self.classes.items()}
        new = (vectors.X[self.test] - mean) * gain
        return Decomposition(scaled, new, labels_of)

    def right(
        self,
        task: str,
        grid: SearchGrid,
        spaces: Sequence[Space],
        neighbours: Integers,
        members: Integers,
    ) -> NDArray[Any]:
        """(candidates, test) whether a grid's candidates are right, by the neighbours
        among some of the trials in some spaces; or their grades."""
        labels = self.classes[task][members]
        answers = self.classes[task][self.test]
        right: NDArray[Any] = votes_right(neighbours, labels, answers)
        if grid.graded:
            clear = clearness(spaces, labels, answers)[..., None]
            right = RIGHT * right + (1.0 - RIGHT) * clear
        places = [min(k, right.shape[-1]) - 1 for k in grid.neighbours]
        # One row for each candidate: for each projection, each k.
        rows = right[..., places].transpose(0, 2, 1)
        return np.asarray(rows.reshape(-1, len(self.test)))


def votes_right(neighbours: Integers, labels: Integers, truth: Integers) -> Booleans:
    """Whether the vote of the first 1, 2, ... k neighbours gives the truth.

    Args:
        neighbours: (..., k) rows, nearest first.
        labels: (rows,) classes.
        truth: broadcasts against neighbours[..., 0].

    Returns:
        (..., k), entry j for k = j + 1. A tie goes to the nearest neighbour among the
        tied.
    """
    classes = labels[neighbours]
    # votes[..., i, j]: how many of the first j + 1 neighbours are of neighbour i's
    # class; 0 where neighbour i is not one of them.
    same = classes[..., :, None] == classes[..., None, :]
    votes = np.triu(np.cumsum(same, axis=-1, dtype=np.int32))
    answers = np.take_along_axis(classes, votes.argmax(axis=-2), axis=-1)
    return np.asarray(answers == np.asarray(truth)[..., None])


def answers_without(
    vectors: Vectors,
    classes: Mapping[str, Integers],
    held_out: Booleans,
    grids: Sequence[SearchGrid],
) -> dict[str, NDArray[Any]]:
    """{task: (candidates, test) whether each candidate is right} of the fit without
    some trials, by a mask (n,), which answers these.

    Those of `graded` grids have grades in place of that: more than a half where the
    answer is right, and the more, the more clearly the right label is nearest
    (`clearness`).
    """
    fit = _Fit(vectors, classes, np.flatnonzero(~held_out), np.flatnonzero(held_out))
    answers: dict[str, list[NDArray[Any]]] = {}
    decomposed = None
    with single_thread():
        for grid in grids:
            for tasks, members in fit.labelled(grid):
                # Neighbouring grids often differ in the projection alone.
                scaled = grid.scaling, grid.features, members.tobytes()
                if decomposed != scaled:
                    decomposed = scaled
                    decomposition = fit.decomposition(grid, members)
                spaces: list[Space] = []
                for task in tasks:
                    if not spaces or (grid.projection == "lda" and not grid.targets):
                        spaces = decomposition.spaces(grid, task)
                        most = min(grid.neighbours[-1], len(members))
                        neighbours = nearest(spaces, most)
                    right = fit.right(task, grid, spaces, neighbours, members)
                    answers.setdefault(task, []).append(right)
    return {task: np.concatenate(right) for task, right in answers.items()}
