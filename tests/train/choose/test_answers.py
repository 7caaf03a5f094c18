"""The answers of one fit to the trials that it leaves out."""

from dataclasses import replace

import numpy as np

from tests.train.choose.test_evaluate import GRIDS, told_right, trials
from train.choose.answers import answers_without, votes_right
from train.model.pipeline import vote


def test_only_the_tasks_that_a_grid_is_for_are_answered():
    labels = trials().y["t"]
    vectors = replace(trials(), y={"t": labels, "u": labels})
    left_out = np.arange(36) < 9
    classes = {task: np.unique(labels, return_inverse=True)[1] for task in "tu"}
    grid = replace(GRIDS[0], tasks=("t",))
    answers = answers_without(vectors, classes, left_out, [grid])
    assert list(answers) == ["t"]
    for choice, right in zip(grid.choices(2), answers["t"], strict=True):
        assert (right == told_right(choice, vectors, ~left_out, left_out)).all()


def test_votes_for_every_k_at_once_are_those_one_by_one():
    rng = np.random.default_rng(0)
    labels = rng.integers(0, 3, 50)
    rows = rng.integers(0, 50, (7, 4, 9))
    truth = rng.integers(0, 3, (7, 1))
    right = votes_right(rows, labels, truth)
    for k in range(1, 10):
        for i in range(7):
            winners = vote(labels[rows[i, :, :k]])
            assert (right[i, :, k - 1] == (winners == truth[i])).all()
