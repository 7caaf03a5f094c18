"""Curves of confidence against the outcomes that they drew."""

from dataclasses import astuple, replace

import numpy as np
import pytest
from scipy.special import expit

from train.model.curves import (
    DOUBT,
    LEAST_DOUBT,
    WITHHELD,
    Curve,
    Evidence,
    cross_fitted,
)


def fitted(margins, excess, right):
    """The curve of answers that count alike."""
    return Curve.of(margins, excess, right, np.ones(margins.shape))


def test_finds_the_curve_that_drew_the_outcomes():
    rng = np.random.default_rng(0)
    margins = rng.normal(scale=2.0, size=40_000)
    excess = rng.exponential(0.5, size=len(margins))
    chance = expit(0.5 * margins + 1.0 - 0.8 * excess)
    curve = fitted(margins, excess, rng.random(len(margins)) < chance)
    assert curve.slope == pytest.approx(0.5, abs=0.05)
    assert curve.intercept == pytest.approx(1.0, abs=0.05)
    assert curve.doubt == pytest.approx(0.8, abs=0.08)


@pytest.mark.parametrize(
    "margins", [np.full(50, 25.0), np.append(np.linspace(0, 1, 30), 40)]
)
@pytest.mark.parametrize("right", [False, True])
def test_equal_outcomes_and_one_far_margin_have_the_best_curve(
    margins,
    right,
):
    outcomes = np.full(len(margins), right)
    curve = fitted(margins, np.zeros(len(margins)), outcomes)
    mean = margins.mean()
    spread = margins.std() or 1.0
    errors = expit(curve.slope * margins + curve.intercept) - right
    assert errors @ (margins - mean) == pytest.approx(
        0.5 * spread * (1.0 - curve.slope * spread)
    )
    assert errors.sum() == pytest.approx(-0.5 * (curve.intercept + curve.slope * mean))


def test_a_larger_margin_never_speaks_against_a_label():
    margins = np.arange(100.0)
    curve = fitted(margins, np.zeros(100), margins < 50)
    assert 0.0 < curve.slope < 1e-3


def test_an_outlier_score_never_speaks_for_a_label():
    excess = np.linspace(0.0, 1.0, 400)
    curve = fitted(np.zeros(400), excess, excess > 0.5)
    assert curve.doubt == LEAST_DOUBT


def test_without_unseen_trials_the_odds_fall_as_assumed():
    rng = np.random.default_rng(3)
    excess = np.full(50, 0.2)
    curve = fitted(rng.normal(size=50), excess, rng.random(50) < 0.8)
    assert curve.doubt == pytest.approx(DOUBT)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.9])
def test_the_mean_probability_is_moved_to_a_share_even_beyond_the_greatest_doubt(share):
    margins = np.linspace(98.0, 102.0, 200)
    excess = np.repeat([0.0, 690.0], 100)
    known = np.linspace(0.5, 1.0, 200)
    honest = np.arange(200) < share * 200
    evidence = Evidence(margins, excess, honest, honest, known, np.ones(200))
    curve = Curve(2.0, 0.5, 1.0).with_mean_of(evidence)
    assert (curve.slope, curve.doubt) == (2.0, 1.0)
    part = share * (1.0 - WITHHELD * 0.25)
    expected = min(max(part, 0.0025), 0.7475)
    mean = (curve.probabilities(margins, excess) * known).mean()
    assert mean == pytest.approx(expected)


def test_a_curve_of_a_point_has_the_mean_of_the_honest_answers_there():
    rng = np.random.default_rng(6)
    numbers = rng.random((3, 2, 80))
    right, honest = rng.random((2, 2, 80)) < [[[0.9]], [[0.6]]]
    known = 0.8 + 0.2 * numbers[2]
    evidence = Evidence(*numbers[:2], right, honest, known, np.ones((2, 80)))
    for point in range(2):
        curve = evidence.at(point).curve()
        likely = curve.probabilities(evidence.margins[point], evidence.excess[point])
        mean = honest[point].mean() * (1.0 - WITHHELD * (1.0 - known[point].mean()))
        assert (likely * known[point]).mean() == pytest.approx(mean)


def test_an_answer_of_weight_two_counts_as_two():
    rng = np.random.default_rng(7)
    margins, excess = rng.random((2, 40))
    right, others = rng.random((2, 40)) < 0.7
    ones = np.ones(40)
    once = Evidence(margins, excess, right, right, ones, ones)
    beside = replace(once, right=others, honest=others)
    weighted = replace(once, weights=2.0 * ones).beside(beside).curve()
    repeated = once.beside(once).beside(beside).curve()
    assert astuple(weighted) == pytest.approx(astuple(repeated))


def test_a_folds_confidences_are_by_the_other_folds_tested_trials_alone():
    rng = np.random.default_rng(5)
    margins = rng.normal(size=(2, 60))
    excess = rng.exponential(size=(2, 60))
    right = rng.random((2, 60)) < 0.7
    folds = np.arange(60) % 3
    tested = np.arange(60) % 5 > 0
    confidences = cross_fitted(margins, excess, right, folds, tested)
    for fold in range(3):
        inside = folds == fold
        others = tested & ~inside
        curve = fitted(margins[:, others], excess[:, others], right[:, others])
        expected = curve.probabilities(margins[:, inside], excess[:, inside])
        assert confidences[:, inside].tolist() == expected.tolist()
