"""Remoteness: known things beside left-out ones."""

import numpy as np
import pytest

from train.model.never_met import (
    SHARE,
    Judged,
    discounted,
    is_unknown,
    remoteness_of,
    thing_folds,
)


def judged(middle, n=400, seed=0, confidence=0.9):
    """Contacts at two decision points, whose remoteness is log-normal around a
    middle."""
    logs = np.random.default_rng(seed).normal(np.log(middle), 0.2, (2, n))
    return Judged(np.full((2, n), confidence), np.exp(logs))


def test_entire_things_are_left_out_where_there_are_enough():
    labels = np.repeat(["a", "b", "c", "d", "e", ""], 3)
    folds = thing_folds(labels)
    assert (folds[labels == ""] == -1).all()
    assert len({(label, fold) for label, fold in zip(labels, folds, strict=True)}) == 6
    assert thing_folds(labels[3:]) is None


def test_the_probability_is_that_of_a_share_of_unmet_things():
    """By Bayes's rule, of two log-normal distributions of one width."""
    remoteness = remoteness_of("t", judged(1.0), judged(1.5, seed=1))
    logs = np.linspace(-0.5, 1.0, 7)
    ratio = (np.log(1.5) * logs - 0.5 * np.log(1.5) ** 2) / 0.2**2
    odds = (1.0 - SHARE) / SHARE * np.exp(-ratio)
    known = [remoteness.known(0, score) for score in np.exp(logs)]
    assert known == pytest.approx(odds / (1.0 + odds), abs=0.05)


def test_training_lowers_confidence_as_the_board_does():
    remoteness = remoteness_of("t", judged(1.0), judged(1.5, seed=1))
    new = judged(1.2, n=9, seed=2, confidence=0.8)
    lowered = discounted(remoteness, new)
    for point in (0, 1):
        expected = [0.8 * remoteness.known(point, r) for r in new.remoteness[point]]
        assert lowered[point] == pytest.approx(expected)


def test_the_worth_is_of_left_out_things():
    remoteness = remoteness_of("t", judged(1.0), judged(1.5, seed=1))
    worth = remoteness.worth
    new = judged(1.5, n=20_000, seed=3)
    unknown = is_unknown(remoteness, new.remoteness)[-1]
    sure = discounted(remoteness, new)[-1] > 0.9
    assert worth["unknown"] == pytest.approx(unknown.mean(), abs=0.06)
    assert worth["sure"] == sure.mean() == 0.0
    assert 0.0 < worth["known"] < 0.04
    assert worth["unsure"] + worth["unknown"] < 1.0


def test_where_nothing_can_be_left_out_the_worth_is_not_known():
    remoteness = remoteness_of("t", judged(1.0), None)
    assert remoteness.worth == {}
    assert remoteness.known(0, 0.9) > 0.9
    assert remoteness.known(0, 3.0) < 0.1
