"""Neighbours of every setting of a grid, against a sort of all distances."""

import numpy as np
import pytest

from train.choose.search import MANY, Decomposition, SearchGrid, _nearest

ROWS = np.array(
    [[0.0, 2.0], [0.0, -2.0], [3.0, 0.0], [-3.0, 0.0], [3.0, 0.0], [-3.0, 0.0]]
)
LABELS = {"t": np.array([0, 0, 1, 2, 1, 2])}


def test_the_nearest_come_first_and_equally_near_ones_in_their_order():
    grid = SearchGrid(components=(1, 2), neighbours=(5,))
    new = np.array([[2.0, 0.0], [0.0, 1.0]])
    near = Decomposition(ROWS, new, LABELS).neighbours(grid, "t")
    assert near.shape == (2, 2, 5)
    # Along the first axis, then in the plane.
    assert near[0, 0].tolist() == [2, 4, 0, 1, 3]
    assert near[1].tolist() == [[2, 4, 0, 1, 3], [0, 1, 2, 3, 4]]


def test_rows_that_never_differ_are_all_equally_near():
    same = np.zeros((6, 2))
    grid = SearchGrid(projection="lda", shrinkages=(0.1,), neighbours=(3,))
    near = Decomposition(same, same[:2], LABELS).neighbours(grid, "t")
    assert near.tolist() == [[[0, 1, 2], [0, 1, 2]]]


@pytest.mark.parametrize("n", [20, MANY // 30 + 1])
def test_few_and_many_trials_have_the_neighbours_of_a_sort(n):
    rng = np.random.default_rng(0)
    training = rng.permutation(10 * n)[: 2 * n].reshape(n, 2)
    tested = rng.integers(0, n, (30, 2))
    squares = ((tested[:, None] - training) ** 2).sum(axis=2)
    (near,) = _nearest([(training.astype(float), tested.astype(float))], 4)
    nearest = np.take_along_axis(squares, near, axis=1)
    np.testing.assert_array_equal(nearest, np.sort(squares, axis=1)[:, :4])
    ties = nearest[:, 1:] == nearest[:, :-1]
    assert (near[:, 1:] > near[:, :-1])[ties].all()
