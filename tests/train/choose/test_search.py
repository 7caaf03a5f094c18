"""Neighbours of every setting of a grid, against a sort of all distances."""

import numpy as np
import pytest

from train.choose.search import MANY, Decomposition, SearchGrid, clearness, nearest

LABELS = {"t": np.array([0, 0, 1, 2, 1, 2])}


def test_rows_that_never_differ_are_all_equally_near():
    same = np.zeros((6, 2))
    grid = SearchGrid(projection="lda", shrinkages=(0.1,), neighbours=(3,))
    near = nearest(Decomposition(same, same[:2], LABELS).spaces(grid, "t"), 3)
    assert near.tolist() == [[[0, 1, 2], [0, 1, 2]]]


def test_an_answer_is_clear_where_the_right_label_is_much_nearer_than_any_other():
    rows = np.array([[0.0], [3.0], [9.0]])
    tested = np.array([[1.0], [2.0], [3.0], [0.0]])
    labels = np.array([0, 1, 1])
    # Squared distances to the right and another label: 1, 4; 4, 1; 0, 9; none is right.
    (clear,) = clearness([(rows, tested)], labels, np.array([0, 0, 1, 2]))
    assert clear.tolist() == pytest.approx([1 - 0.2**2, 1 - 0.8**2, 1.0, 0.0])
    (equal,) = clearness([(rows, rows[:1])], np.array([0, 0, 0]), np.array([0]))
    assert equal.tolist() == [1.0]  # there is no other label


@pytest.mark.parametrize("n", [20, MANY // 30 + 1])
def test_few_and_many_trials_have_the_neighbours_of_a_sort(n):
    rng = np.random.default_rng(0)
    training = rng.permutation(10 * n)[: 2 * n].reshape(n, 2)
    tested = rng.integers(0, n, (30, 2))
    squares = ((tested[:, None] - training) ** 2).sum(axis=2)
    (near,) = nearest([(training.astype(float), tested.astype(float))], 4)
    smallest = np.take_along_axis(squares, near, axis=1)
    np.testing.assert_array_equal(smallest, np.sort(squares, axis=1)[:, :4])
    ties = smallest[:, 1:] == smallest[:, :-1]
    assert (near[:, 1:] > near[:, :-1])[ties].all()
