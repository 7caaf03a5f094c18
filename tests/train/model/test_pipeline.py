"""Votes, neighbours and all tasks of a model, against the rules."""

import numpy as np
import pytest

from edge.errors import InputError
from tests.checks.hard_cases.models import features
from train.model.pipeline import (
    Choice,
    ContactClassifier,
    nearest_of_label,
    slope,
)


def test_a_twentieth_of_a_labels_trials_stand_for_it_but_three_if_there_are():
    sizes = np.array([0, 2, 3, 59, 61, 100])
    assert nearest_of_label(sizes).tolist() == [0, 2, 3, 3, 4, 5]


def test_the_slope_makes_a_share_of_right_answers_their_log_odds():
    """At one size of gap the maximum is known: odds of 8.5 to 2.5 for 8 of 10, by half
    a trial."""
    assert slope(np.repeat([2.0, -2.0], [8, 2])) == pytest.approx(
        np.log(8.5 / 2.5) / 2.0
    )
    assert slope(np.full(9, 1e-9)) == pytest.approx(np.log(9.5 / 0.5) * 1e9)
    assert slope(np.repeat([1.0, -1.0], [1, 8])) == pytest.approx(1e-3)
    assert slope(np.zeros(3)) == slope(np.zeros(0)) == 1.0


def test_labels_that_say_nothing_of_new_trials_weigh_nothing():
    """Discriminants of 200 columns separate any two labels of 40 trials, but not of new
    ones."""
    X = np.random.default_rng(0).normal(size=(40, 200))
    y = {"real": np.tile(["a", "b"], 20)}
    X[::2, 0] += 9.0
    y["random"] = np.random.default_rng(1).permutation(y["real"])
    choices = dict.fromkeys(y, Choice("none", 1, 1, "lda", 1e-3))
    model = ContactClassifier(choices, ["max_force"], [200]).fit(X, y)
    gaps = {
        task: np.ptp(decision.distances, axis=1)
        for task, decision in model.decide(X).items()
    }
    assert gaps["random"].max() < 2.0 < gaps["real"].min()


@pytest.mark.parametrize(
    ("choice", "word"),
    [
        (Choice("none", 0, 1), "components must be"),
        (Choice("VI", 5, 1), "scaling must be one of none, I"),
    ],
)
def test_choices_that_make_no_sense_are_named(choice, word):
    with pytest.raises(InputError, match=word):
        ContactClassifier({"t": choice}).fit(
            features(30), {"t": np.repeat(["a", "b"], 15)}
        )
