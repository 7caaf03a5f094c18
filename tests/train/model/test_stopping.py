"""Calibrated confidences: logistic curves, folds, the outlier score, and the trials of
each task."""

import numpy as np
import pytest
from scipy.special import logit

from edge.decide.early import fastest
from edge.decide.info import OutlierLimits
from edge.errors import InputError
from train.data.folds import stratified_folds
from train.model.held_out import answers
from train.model.pipeline import Choice
from train.model.stopping import (
    SequentialClassifier,
    excess_of,
)

SECONDS = np.array([0.4, 0.8, 1.2])


def of_neighbours(k):
    """The settings of a task with k neighbours."""
    return {"t": Choice("none", 3, k)}


def calibrated(choices, X, y, folds=None, without=None):
    """A model whose settings serve every fold too, unless there are others."""
    if folds is None:
        folds = stratified_folds(next(iter(y.values())))
    model = SequentialClassifier(choices, SECONDS, ("max_force",))
    return model.fit(X, y, folds, without or [choices] * 10)


def touches(n):
    """At the first decision point the labels look alike; from the second on they do
    not."""
    rng = np.random.default_rng(0)
    labels = rng.choice(["a", "b"], n)
    X = rng.normal(size=(3, n, 12))
    X[1:, :, 0] += 30.0 * (labels == "a")
    return X, labels


def test_what_is_plain_from_the_second_decision_point_on_is_decided_there():
    X, labels = touches(120)
    model = calibrated(of_neighbours(3), X, {"t": labels})
    assert fastest(model.stopping_["t"], 0.1).mean_s <= 0.83


def test_an_excess_is_that_above_half_of_the_trials():
    scores = np.array([[1.0, 2.0, 2.0 * np.e, np.nan]])
    excess = excess_of(OutlierLimits((2.0,), (9.0,)), scores)
    assert excess[0].tolist() == pytest.approx([0.0, 0.0, 1.0, 0.0])


def test_rules_ask_for_the_same_margin_at_every_decision_point():
    X, labels = touches(60)
    model = calibrated(of_neighbours(3), X, {"t": labels})
    _, margins = answers(model.decision_points_, X)["t"]
    excess = excess_of(model.outlier_score_, model.space_.scores(X).outlier_score)
    first, second, last = (at.tasks_["t"].slope for at in model.decision_points_)
    assert first == second != last
    *_, series = model.judged(X, {"t": labels})
    log_odds = logit(series["t"].confidences[0])
    stopping = model.stopping_["t"]
    expected = stopping.slope * margins + stopping.intercept - stopping.doubt * excess
    assert log_odds == pytest.approx(expected)


def test_the_full_window_has_a_curve_of_its_own():
    """Early answers are right by chance, those of the full window always."""
    X, labels = touches(60)
    X[1] = X[0]
    things = np.char.add(labels, (np.arange(60) % 3).astype(str))
    choices = {**of_neighbours(3), "thing": Choice("none", 3, 3)}
    model = calibrated(choices, X, {"t": labels, "thing": things})
    stopping = model.stopping_["t"]
    assert stopping.slopes[:2] == (stopping.slope,) * 2
    assert stopping.intercepts[:2] == (stopping.intercept,) * 2
    assert stopping.slopes[2] != stopping.slope
    assert stopping.intercepts[2] != stopping.intercept


def test_answers_to_groups_that_were_not_met_lower_the_confidence_at_the_full_window():
    """Where a sixth of the objects is left out, its trials are called wrongly."""
    X, labels = touches(120)
    things = np.arange(120) % 6
    X[:, things == 3, 0] = np.where(labels[things == 3] == "a", 0.0, 30.0)
    X[:, things == 3, 1] += 300.0
    choices = {**of_neighbours(3), "thing": Choice("none", 3, 3)}
    y = {"t": labels, "thing": things.astype(str)}
    calibration = X, y, stratified_folds(labels), [choices] * 10
    model = SequentialClassifier(choices, SECONDS, ("max_force",))
    known = model.fit(*calibration).stopping_["t"]
    with_others = model.fit(*calibration, ["t"]).stopping_["t"]
    assert model.right_["t"][-1].all()
    assert with_others.intercepts[:2] == known.intercepts[:2]
    assert with_others.intercepts[2] < known.intercepts[2]
    assert with_others.rules == known.rules


def test_each_fold_is_answered_by_what_was_chosen_without_it():
    X, labels = touches(60)
    folds = stratified_folds(labels)
    choices = of_neighbours(3)
    bad = {"t": Choice("none", 1, 59 - int((folds == 0).sum()))}
    without = [bad, *[choices] * 9]
    model = calibrated(choices, X, {"t": labels}, folds, without)
    right = model.right_["t"][-1]
    assert right[folds != 0].all()
    assert not right[folds == 0].all()
    assert model.stopping_["t"].wrong >= (~right).sum()


def test_trials_without_a_fold_calibrate_nothing():
    X, labels = touches(80)
    folds = stratified_folds(labels)
    folds[60:] = -1
    X[:, 60:, 1] += 1e3
    model = calibrated(of_neighbours(3), X, {"t": labels}, folds)
    assert model.stopping_["t"].trials == 60
    assert not model.unusual_[:, 60:].any()


def test_trials_that_are_copies_set_no_limit():
    X, labels = touches(60)
    rows = [*range(60), *range(40)]
    copied = calibrated(of_neighbours(3), X[:, rows], {"t": labels[rows]})
    single = calibrated(of_neighbours(3), X, {"t": labels})
    ratio = np.divide(copied.outlier_score_.typical, single.outlier_score_.typical)
    assert ratio.min() > 0.3
    assert ratio.max() < 3.0


def test_an_unknown_thing_is_an_error_of_the_task_that_then_names_nothing():
    X, labels = touches(200)
    things = np.char.add(labels, np.where(X[1, :, 1] > 0, "+", "-"))
    choices = {"kind": Choice("none", 12, 1), "thing": Choice("none", 12, 1)}
    model = calibrated(choices, X, {"kind": labels, "thing": things})
    assert model.stopping_["thing"].known_distance is not None
    assert model.stopping_["kind"].known_distance is None
    unknown = model.unknown_[-1]
    right = {task: answers[-1] for task, answers in model.right_.items()}
    assert 0 < (unknown & right["thing"]).sum() < 10
    assert model.stopping_["kind"].wrong == int((~right["kind"]).sum())
    assert model.stopping_["thing"].wrong == int((~right["thing"] | unknown).sum())


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
    assert (model.space_.scores(X[..., model.columns_]).outlier_score == 0.0).all()


def test_too_few_trials_are_refused():
    X, labels = touches(19)
    with pytest.raises(
        InputError, match="calibration needs at least 20 trials, not 19"
    ):
        calibrated(of_neighbours(1), X, {"t": labels})
    X, labels = touches(20)
    assert calibrated(of_neighbours(1), X, {"t": labels}).stopping_["t"].trials == 20


def test_a_kind_is_no_name_though_it_has_more_labels():
    X, labels = touches(60)
    moves = np.where(np.arange(60) % 2, "fixed", "movable")
    y = {"kind": np.char.add(labels, moves), "soft": labels, "moves": moves}
    y["thing"] = np.where(np.arange(60) < 30, "cup", "box")
    choices = dict.fromkeys(y, Choice("none", 3, 1))
    stopping = calibrated(choices, X, y).stopping_
    tasks = [task for task, of_task in stopping.items() if of_task.known_distance]
    assert tasks == ["thing"]
