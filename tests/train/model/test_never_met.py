"""The distance to known objects: known objects beside left-out ones."""

import numpy as np
import pytest

from train.model.never_met import (
    SHARE,
    known_distance_of,
    known_of,
    object_folds,
    worth_of,
)


def remote(middle, n=400, seed=0):
    """The distance to known objects at two decision points, log-normal around a
    middle."""
    logs = np.random.default_rng(seed).normal(np.log(middle), 0.2, (2, n))
    return np.exp(logs)


def test_entire_things_are_left_out_where_there_are_enough():
    labels = np.repeat(["a", "b", "c", "d", "e", ""], 3)
    folds = object_folds(labels)
    assert (folds[labels == ""] == -1).all()
    assert len({*zip(labels, folds, strict=True)}) == 6
    assert object_folds(labels[3:]) is None


def test_the_probability_is_that_of_a_share_of_unmet_things():
    """By Bayes's rule, of two log-normal distributions of one width."""
    known_distance = known_distance_of(remote(1.0), remote(1.5, seed=1))
    logs = np.linspace(-0.5, 1.0, 7)
    ratio = (np.log(1.5) * logs - 0.5 * np.log(1.5) ** 2) / 0.2**2
    odds = (1.0 - SHARE) / SHARE * np.exp(-ratio)
    probabilities = [known_distance.known(0, score) for score in np.exp(logs)]
    assert probabilities == pytest.approx(odds / (1.0 + odds), abs=0.06)


def test_training_knows_things_as_the_board_does():
    known_distance = known_distance_of(remote(1.0), remote(1.5, seed=1))
    new = remote(1.2, n=9, seed=2)
    for point, probabilities in enumerate(known_of(known_distance, new)):
        expected = [known_distance.known(point, score) for score in new[point]]
        assert probabilities == pytest.approx(expected)


def test_where_nothing_can_be_left_out_the_usual_curve_serves():
    known_distance = known_distance_of(remote(1.0), None)
    assert known_distance.worth == {}
    assert known_distance.known(0, 0.9) > 0.9
    assert known_distance.known(0, 5.0) < 0.1


def test_what_is_unknown_has_no_name_to_be_sure_of():
    probabilities = np.arange(50) == 0
    unknown = np.array([True, True, False, False, False])
    confidence = np.array([0.95, 0.3, 0.95, 0.3, 0.7])
    assert worth_of(probabilities, unknown, confidence) == {
        "known": 0.02,
        "unknown": 0.4,
        "unsure": 0.2,
        "sure": 0.2,
    }
