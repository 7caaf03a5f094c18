"""Labels are struck out for good; one left decides, none left is unknown."""

import numpy as np
import pytest

from edge.errors import InputError
from edge.model.prediction_set import PredictionSet, check_rate

A, B, C = range(3)


def decision_point(*values, far=0.9, folds=1):
    """P-values of three labels, the same in every fold."""
    return np.tile([*values, far], (folds, 1))


def test_before_any_look_every_label_is_left():
    candidates = PredictionSet(3, 0.1)
    assert candidates.remaining == [A, B, C]
    assert not candidates.settled
    assert candidates.best(B) == B


def test_one_label_left_settles_and_its_confidence_is_that_of_the_last_rival():
    candidates = PredictionSet(3, 0.1)
    candidates.narrow(decision_point(0.5, 0.2, 0.04))
    assert candidates.remaining == [A, B]
    assert not candidates.settled
    candidates.narrow(decision_point(0.5, 0.08, 0.3))
    assert candidates.remaining == [A]
    assert candidates.settled
    assert not candidates.unknown
    assert candidates.confidence(A) == pytest.approx(1 - 0.08)


def test_a_label_once_struck_out_stays_out():
    candidates = PredictionSet(3, 0.1)
    candidates.narrow(decision_point(0.1, 0.5, 0.5))
    candidates.narrow(decision_point(0.9, 0.5, 0.5))
    assert candidates.remaining == [B, C]
    assert candidates.pvalues.tolist() == [0.1, 0.5, 0.5]


def test_the_least_is_taken_in_each_fold_before_the_mean():
    candidates = PredictionSet(3, 0.1)
    candidates.narrow(np.array([[0.2, 1.0, 1.0, 1.0], [0.8, 1.0, 1.0, 1.0]]))
    candidates.narrow(np.array([[0.8, 1.0, 1.0, 1.0], [0.2, 1.0, 1.0, 1.0]]))
    assert candidates.pvalues.tolist() == [0.2, 1.0, 1.0]


def test_no_label_left_or_too_far_from_all_is_unknown():
    none_left = PredictionSet(3, 0.1)
    none_left.narrow(decision_point(0.1, 0.05, 0.02))
    assert none_left.unknown
    assert none_left.settled
    assert none_left.remaining == []
    far = PredictionSet(3, 0.1, novelty_rate=0.05)
    far.narrow(decision_point(0.9, 0.05, 0.02, far=0.05))
    assert far.unknown
    assert far.confidence(A) == pytest.approx(0.95)


def test_the_best_of_several_is_the_vote_s_answer_where_it_is_left():
    candidates = PredictionSet(3, 0.1)
    candidates.narrow(decision_point(0.3, 0.6, 0.05))
    assert candidates.best(A) == A
    assert candidates.best(C) == B


@pytest.mark.parametrize("rate", [0.0, 1.0, -0.1, 1.5, float("nan")])
def test_a_rate_outside_its_range_is_refused(rate):
    with pytest.raises(InputError, match="--error must be above 0 and below 1"):
        check_rate(rate, "--error")
