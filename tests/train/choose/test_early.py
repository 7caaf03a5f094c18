"""Settings before the full window: which trials are decided when sure, and how the
errors of these choose."""

from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from edge.record.saving import save
from train.choose.candidates import candidates, features_of
from train.choose.choose import Choosing
from train.choose.early import (
    SHARES,
    SHRINKAGES,
    SureDecisions,
    early_options,
    settle_early,
)
from train.choose.options import FitOptions
from train.data.dataset import Measurement, load_trials
from train.data.groups import Divisions
from train.data.vectors import Vectors
from train.model.held_out import HeldOut
from train.model.pipeline import Choice

SECONDS = np.array([0.4, 0.8, 1.2])


class TestSureDecisions:
    """Of two trials, one is sure from the first decision point on, the other at the
    last."""

    MARGINS = np.array([[5.0, 1.0], [5.0, 2.0], [5.0, 9.0]])
    RIGHT = np.array([[True, False], [True, False], [True, True]])

    def decisions(self, *parts):
        right = {"a": self.RIGHT, "b": ~self.RIGHT}
        margins = {"a": self.MARGINS, "b": self.MARGINS[:, ::-1]}
        return SureDecisions.of(HeldOut(right, margins), parts, SECONDS)

    def test_of_low_thresholds_decide_at_once_and_those_of_high_ones_at_the_end(self):
        decided = self.decisions("a")
        assert decided.seconds[0].tolist() == [0.4, 0.4]
        assert decided.wrong[0].tolist() == [False, True]
        assert decided.seconds[-1].tolist() == [1.2, 1.2]
        assert not decided.wrong[-1].any()
        assert (np.diff(decided.seconds, axis=0) >= 0.0).all()

    def test_a_joint_task_waits_for_the_later_factor_and_errs_where_either_does(self):
        decided = self.decisions("a", "b")
        assert decided.wrong[0].tolist() == [True, True]
        assert decided.seconds[-1].tolist() == [1.2, 1.2]

    def test_the_error_is_that_of_some_trials_between_two_thresholds(self):
        decided = SureDecisions(
            np.array([[0.4, 0.4], [0.4, 1.2]]),
            np.array([[False, True], [False, False]]),
        )
        everything = np.array([True, True])
        assert decided.error(np.array([0.4, 0.6]), everything) == pytest.approx(0.375)
        assert decided.error(np.array([0.6]), np.array([True, False])) == 0.0


def test_decision_points_before_the_full_window_have_settings_of_their_own(
    make_touch, tmp_path
):
    for kind, seed in product(("hard", "soft"), range(5)):
        touch = make_touch(kind=kind, seed=seed, labels={"softness": kind})
        save(tmp_path / f"{kind}-{seed}.npz", touch)
    (contact,) = candidates({}, FitOptions(features=["contact"], projection="lda"))
    dataset = load_trials([tmp_path], Measurement(features_of([contact])))
    y = {"softness": dataset.labels("softness")}
    choosing = Choosing(dataset, y, [contact], Divisions.of(dataset, y), samples=10)
    pick = Choice("IV", 1, 3, "lda", 1.0, contact.grids[0].features)
    early = choosing.early(
        1.2, {"softness": SimpleNamespace(choice=pick, picks=[pick])}
    )
    assert early.choices["softness"].shrinkage in SHRINKAGES
    assert len(early.by_fold) == 10


def test_options_are_surviving_discriminants_no_wider_than_the_full_window():
    together = Choice("IV", 9, 1, "lda", 1e-3, ("max_force",), ("t", "u"))
    full = {"t": replace(together, k=5), "u": together}
    picks = [
        together,
        replace(together, scaling="columns"),
        replace(together, targets=()),
        replace(together, features=("max_force", "contact_area")),
        replace(together, projection="pca"),
    ]
    options = early_options(picks, full, {"max_force": 5, "contact_area": 5})
    assert {option["t"].scaling for option in options} == {"IV", "columns"}
    assert {option["t"].shrinkage for option in options} == set(SHRINKAGES)
    assert {(option["t"].k, option["u"].k) for option in options} == {(5, 1)}
    assert {option["t"].features for option in options} == {("max_force",)}
    assert len(options) == 2 * len(SHRINKAGES)


@pytest.fixture
def settled():
    """The function that settles between two features, each of which tells the labels
    apart early for the trials of one half of the folds."""
    rng = np.random.default_rng(1)
    labels = np.array(["a", "b"] * 60)
    folds = np.arange(120) // 12

    def settle(first_tells):
        X = rng.normal(size=(len(SHARES) + 1, 120, 2))
        signs = np.where(labels == "a", 9.0, -9.0)
        X[:, :, 0] += signs * first_tells
        X[:, :, 1] += signs * ~first_tells
        X[-1] += signs[:, None]
        vectors = Vectors(X, {"t": labels}, ("max_force", "contact_area"), (1, 1))
        first = {"t": Choice("none", 1, 1, "lda", features=("max_force",))}
        second = {"t": Choice("none", 1, 1, "lda", features=("contact_area",))}
        early = settle_early(vectors, 1.2, [first, second], folds, 1)
        by_fold = [choices["t"].features[0] for choices in early.by_fold]
        return early.choices["t"].features[0], by_fold

    return settle


def test_the_option_that_errs_least_often_when_sure_is_settled(settled):
    assert settled(np.full(120, True))[0] == "max_force"
    assert settled(np.full(120, False))[0] == "contact_area"


def test_what_is_settled_without_a_fold_counts_the_trials_of_the_others(settled):
    """The first feature tells the trials of five folds of ten and two more; without one
    of them, of four."""
    choice, by_fold = settled(np.arange(120) < 62)
    assert choice == "max_force"
    assert by_fold[9] == "max_force"
    assert by_fold[0] == "contact_area"
