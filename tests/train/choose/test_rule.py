"""Which candidate is chosen by answers, and which grids are dropped."""

import numpy as np
import pytest

from train.choose.rule import Rule


def test_the_cheapest_within_a_standard_error_of_the_difference_is_chosen():
    right = np.ones((3, 100), dtype=bool)
    right[0, :20] = False  # 20 worse than the best, with an error of 4
    right[1, 20:23] = right[2, 98:] = False  # 1 worse, with an error of 2.2
    rising = np.arange(3)
    assert Rule().choose(right) == 2
    assert Rule(rising).choose(right) == 1
    assert Rule(np.array([0, 2, 1])).choose(right) == 2
    assert Rule(rising, allowed=np.array([0, 2])).choose(right) == 2


def test_of_candidates_that_cost_the_same_the_best_is_chosen():
    """By how it is better the error of a difference does not ask: nothing is saved by
    the other."""
    right = np.ones((4, 100), dtype=bool)
    right[0, :3] = right[1, 2:4] = right[2, 4:6] = False
    right[3, 50:] = False
    assert Rule(np.array([1, 1, 1, 0])).choose(right) == 1


@pytest.fixture
def answers():
    """Forty answers each of three candidates: one that errs twice, one that errs there
    and in two more, and one that errs in ten others."""
    right = np.ones((3, 40), dtype=bool)
    right[:2, :2] = right[1, 2:4] = right[2, 30:] = False
    return right


def dropped(prices, right, grids):
    """What is dropped where all may be chosen."""
    return Rule(prices, np.arange(3)).dropped(right, np.array(grids))


def test_grids_that_are_clearly_behind_or_dearer_and_never_better_are_dropped(answers):
    assert dropped(np.array([0, 1, 2]), answers, [4, 5, 6]) == [5, 6]
    # A cheaper one that is behind by no more than chance may win yet.
    assert dropped(np.array([2, 1, 0]), answers, [4, 5, 6]) == [6]
    assert dropped(None, answers, [4, 5, 6]) == [6]


def test_a_grid_counts_by_its_best_candidate(answers):
    assert dropped(np.array([1, 1, 1]), answers, [4, 5, 5]) == []
