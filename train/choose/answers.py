"""The answers of all candidates to the trials that a fit leaves out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from edge.arrays import Booleans, Integers
from train.choose.crossval import votes_right
from train.choose.search import Decomposition, SearchGrid
from train.data.vectors import Vectors
from train.model.scaling import centred_and_scaled
from train.threads import single_thread


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
        neighbours: Integers,
        members: Integers,
    ) -> Booleans:
        """(candidates, test) whether a grid's candidates are right, by the neighbours
        among some of the trials."""
        labels = self.classes[task]
        right = votes_right(neighbours, labels[members], labels[self.test])
        places = [min(k, right.shape[-1]) - 1 for k in grid.neighbours]
        # One row for each candidate: for each projection, each k.
        rows = right[..., places].transpose(0, 2, 1)
        return np.asarray(rows.reshape(-1, len(self.test)))


def answers_without(
    vectors: Vectors,
    classes: Mapping[str, Integers],
    left_out: Booleans,
    grids: Sequence[SearchGrid],
) -> dict[str, Booleans]:
    """{task: (candidates, test) whether each candidate is right} of the fit without
    some trials, by a mask (n,), which answers these."""
    fit = _Fit(vectors, classes, np.flatnonzero(~left_out), np.flatnonzero(left_out))
    answers: dict[str, list[Booleans]] = {}
    decomposed = None
    with single_thread():
        for grid in grids:
            for tasks, members in fit.labelled(grid):
                # Neighbouring grids often differ in the projection alone.
                scaled = grid.scaling, grid.features, members.tobytes()
                if decomposed != scaled:
                    decomposed = scaled
                    decomposition = fit.decomposition(grid, members)
                neighbours = None
                for task in tasks:
                    if neighbours is None or (
                        grid.projection == "lda" and not grid.targets
                    ):
                        neighbours = decomposition.neighbours(grid, task)
                    answers.setdefault(task, []).append(
                        fit.right(task, grid, neighbours, members)
                    )
    return {task: np.concatenate(right) for task, right in answers.items()}
