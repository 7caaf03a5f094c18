"""The answers of one fit to the trials that it leaves out."""

from dataclasses import replace

import numpy as np

from tests.train.choose.test_evaluate import GRIDS, told_right, trials
from train.choose.answers import answers_without


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
