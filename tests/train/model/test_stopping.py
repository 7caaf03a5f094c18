"""Calibrated confidences: logistic curves, folds, novelty, and the trials of each
task."""

import numpy as np
import pytest
from scipy.special import expit, logit

from edge.errors import InputError
from edge.model.info import NOVELTY_RATE
from train.data.folds import stratified_folds
from train.model.pipeline import Choice
from train.model.stopping import (
    DOUBT,
    LEAST_DOUBT,
    Curve,
    SequentialClassifier,
    answers,
    excess_of,
    unlike,
)


class TestCurve:
    def test_finds_the_curve_that_drew_the_outcomes(self):
        rng = np.random.default_rng(0)
        margins = rng.normal(scale=2.0, size=40_000)
        excess = rng.exponential(0.5, size=len(margins))
        chance = expit(0.5 * margins + 1.0 - 0.8 * excess)
        curve = Curve.of(margins, excess, rng.random(len(margins)) < chance)
        assert curve.slope == pytest.approx(0.5, abs=0.05)
        assert curve.intercept == pytest.approx(1.0, abs=0.05)
        assert curve.doubt == pytest.approx(0.8, abs=0.08)

    @pytest.mark.parametrize(
        "margins", [np.full(50, 25.0), np.append(np.linspace(0, 1, 30), 40)]
    )
    @pytest.mark.parametrize("right", [False, True])
    def test_equal_outcomes_and_one_far_margin_have_the_best_curve(
        self,
        margins,
        right,
    ):
        outcomes = np.full(len(margins), right)
        curve = Curve.of(margins, np.zeros(len(margins)), outcomes)
        mean = margins.mean()
        spread = margins.std() or 1.0
        errors = expit(curve.slope * margins + curve.intercept) - right
        assert errors @ (margins - mean) == pytest.approx(
            0.5 * spread * (1.0 - curve.slope * spread)
        )
        assert errors.sum() == pytest.approx(
            -0.5 * (curve.intercept + curve.slope * mean)
        )

    def test_a_larger_margin_never_speaks_against_a_label(self):
        margins = np.arange(100.0)
        curve = Curve.of(margins, np.zeros(100), margins < 50)
        assert 0.0 < curve.slope < 1e-3

    def test_novelty_never_speaks_for_a_label(self):
        excess = np.linspace(0.0, 1.0, 400)
        curve = Curve.of(np.zeros(400), excess, excess > 0.5)
        assert curve.doubt == LEAST_DOUBT

    def test_without_novel_trials_the_odds_fall_as_assumed(self):
        rng = np.random.default_rng(3)
        excess = np.full(50, 0.2)
        curve = Curve.of(rng.normal(size=50), excess, rng.random(50) < 0.8)
        assert curve.doubt == pytest.approx(DOUBT)

    def test_the_unit_of_the_distances_does_not_matter(self):
        rng = np.random.default_rng(2)
        margins = rng.normal(size=60)
        right = rng.random(60) < 0.8
        excess = np.zeros(60)
        in_metres = Curve.of(margins, excess, right)
        in_microns = Curve.of(1e-6 * margins, excess, right)
        assert in_metres.probabilities(margins, excess) == pytest.approx(
            in_microns.probabilities(1e-6 * margins, excess)
        )

    @pytest.mark.parametrize("share", [0.0, 0.3, 0.9, 1.0])
    def test_the_mean_probability_is_moved_to_a_share(self, share):
        rng = np.random.default_rng(4)
        margins = rng.normal(size=200)
        excess = rng.exponential(size=200)
        curve = Curve(2.0, 0.5, 1.0).with_mean(margins, excess, share)
        assert curve.slope == 2.0
        assert curve.doubt == 1.0
        expected = min(max(share, 0.5 / 200), 1.0 - 0.5 / 200)
        assert curve.probabilities(margins, excess).mean() == pytest.approx(expected)


SECONDS = np.array([0.4, 0.8, 1.2])


def of_neighbours(k):
    """The settings of a task with k neighbours."""
    return {"t": Choice("none", 3, k)}


def calibrated(choices, X, y):
    """A model whose settings serve every fold too."""
    folds = stratified_folds(next(iter(y.values())))
    return SequentialClassifier(choices, SECONDS, ("max_force",)).fit(
        X,
        y,
        folds,
        [choices] * 10,
    )


def touches(n, seed=0):
    """At the first decision point the labels look alike; from the second on they do
    not."""
    rng = np.random.default_rng(seed)
    labels = rng.choice(["a", "b"], n)
    X = rng.normal(size=(3, n, 12))
    X[1:, :, 0] += 30.0 * (labels == "a")
    return X, labels


def test_what_is_plain_from_the_second_decision_point_on_is_decided_there():
    X, labels = touches(120)
    model = calibrated(of_neighbours(3), X, {"t": labels})
    assert model.stopping_["t"].rule(0.1).mean_s <= 0.83
    new, truth = touches(300, seed=1)
    named, _ = answers(model.decision_points_, new)["t"]
    assert (named[1:] == truth).all()


def test_rules_ask_for_the_same_margin_at_every_decision_point():
    X, labels = touches(60)
    model = calibrated(of_neighbours(3), X, {"t": labels})
    _, margins = answers(model.decision_points_, X)["t"]
    excess = excess_of(model.novelty_, model.space_.scores(X))
    *_, courses = model.judged(X, {"t": labels})
    log_odds = logit(courses["t"].confidences[0])
    stopping = model.stopping_["t"]
    expected = stopping.slope * margins + stopping.intercept - stopping.doubt * excess
    assert log_odds == pytest.approx(expected)


def test_each_fold_is_answered_by_what_was_chosen_without_it():
    X, labels = touches(60)
    folds = stratified_folds(labels)
    choices = of_neighbours(3)
    bad = {"t": Choice("none", 1, 59 - int((folds == 0).sum()))}
    without = [bad, *[choices] * 9]
    model = SequentialClassifier(choices, SECONDS, ("max_force",))
    right = model.fit(X, {"t": labels}, folds, without).right_["t"][-1]
    assert right[folds != 0].all()
    assert not right[folds == 0].all()


def test_a_held_out_trial_is_never_its_own_neighbour():
    X, labels = touches(60)
    model = calibrated(of_neighbours(1), X, {"t": labels})
    assert (np.array(model.novelty_.limits) > 0.0).all()
    assert (model.space_.scores(X) == 0.0).all()


def test_a_touch_unlike_all_others_is_an_error_of_the_task_that_then_names_nothing():
    X, labels = touches(200)
    things = np.char.add(labels, np.where(X[1, :, 1] > 0, "+", "-"))
    choices = {"kind": Choice("none", 12, 1), "thing": Choice("none", 12, 1)}
    model = calibrated(choices, X, {"kind": labels, "thing": things})
    assert model.novelty_.task == "thing"
    unknown = model.unknown_[-1]
    right = {task: answers[-1] for task, answers in model.right_.items()}
    assert 0 < (unknown & right["thing"]).sum() < 10
    assert model.stopping_["kind"].wrong == int((~right["kind"]).sum())
    assert model.stopping_["thing"].wrong == int((~right["thing"] | unknown).sum())


def test_a_touch_is_unknown_beyond_the_limit_of_its_decision_point():
    X, labels = touches(60)
    novelty = calibrated(of_neighbours(1), X, {"t": labels}).novelty_
    distances = np.array([row[-2] for row in novelty.limits])[:, None] + [0.0, 1e-9]
    assert novelty.rates[-2] == NOVELTY_RATE
    assert unlike(novelty, distances).tolist() == [[False, True]] * 3
    assert novelty.rate(1, float(distances[1, 1])) <= NOVELTY_RATE


def test_what_no_task_takes_is_there_for_the_folds_alone():
    """The folds may choose features that the model does not: its own vectors are
    narrower."""
    X, labels = touches(60)
    names = ("max_force", "contact_area")
    folds = stratified_folds(labels)
    blind = {"t": Choice("none", 3, 3, features=names[1:])}
    seeing = {"t": Choice("none", 3, 3, features=names[:1])}
    model = SequentialClassifier(blind, SECONDS, names)
    model.fit(X, {"t": labels}, folds, [seeing] * 10)
    assert model.columns_.tolist() == list(range(6, 12))
    assert model.n_features_in_ == 6
    assert model.right_["t"][-1].all()
    assert (model.space_.scores(X[..., model.columns_]) == 0.0).all()


def test_too_few_trials_are_refused():
    X, labels = touches(19)
    with pytest.raises(
        InputError, match="calibration needs at least 20 trials, not 19"
    ):
        calibrated(of_neighbours(1), X, {"t": labels})
