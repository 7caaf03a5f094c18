"""Scores of the reports: their columns, the best cell, nested accuracy,
baselines."""

import numpy as np
import pytest

from edge.decide.statistics import paired as in_shares
from tests.train.choose.test_evaluate import trials
from train.model.pipeline import Choice, ContactClassifier
from train.report.score import (
    Result,
    grid_search,
    interval,
    majority,
    paired,
    points,
)

ONE = ("max_force",)


def test_the_best_cell_is_as_accurate_as_models_without_each_trial():
    vectors = trials(26)
    y = vectors.y["t"]
    best = grid_search(vectors.X, vectors.y, features=ONE)["t"]
    choice = Choice("none", best.components, best.k)
    right = 0
    for trial in range(26):
        others = np.delete(np.arange(26), trial)
        model = ContactClassifier.of({"t": choice}, vectors.part(others))
        answer = model.decide(vectors.X[[trial]])["t"].labels
        right += model.tasks_["t"].classes[answer[0]] == y[trial]
    assert best.right == right


def test_an_interval_is_in_whole_percent():
    assert interval(Result(10, 20)) == "30 to 70"


def test_points_are_whole_and_have_a_sign():
    assert points((-0.4, -7.5, 3.2)) == "+0 (-8 to +3)"


def test_guessing_names_the_most_frequent_label():
    assert majority(np.array(["a", "b", "b"])) == Result(2, 3)


def test_a_paired_difference_is_in_points_of_the_same_trials():
    before = np.array([True, True, False, False, False])
    after = np.array([True, False, True, True, False])
    points, low, high = paired(before, after)
    assert points == pytest.approx(20.0)
    assert (low, high) == pytest.approx(tuple(100.0 * np.array(in_shares(2, 1, 5))))
