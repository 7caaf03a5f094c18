"""Successive halving: the order of the fits, and that no choice sees its own fold."""

from dataclasses import replace

import numpy as np
import pytest

from train.choose.evaluate import Halving, evaluate
from train.choose.halving import fold_pairs, folds_near, rungs
from train.choose.rule import Rule
from train.choose.search import SearchGrid
from train.data.vectors import Vectors

FOLDS = np.arange(220) % 11
GRIDS = [
    SearchGrid("IV", "pca", (name,), components=(1, 2), neighbours=(3,))
    for name in ("max_force", "contact_area", "contact_motion")
]


def by_price(task, choices):
    """The rule of candidates of which the first are the cheapest."""
    return Rule(np.arange(len(choices)))


def test_the_first_fits_serve_each_choice_with_the_folds_beside_its_own():
    steps = rungs(11, nested=True)
    assert [reach for reach, _ in steps] == [2, 4, 11]
    assert sorted(pair for _, pairs in steps for pair in pairs) == fold_pairs(11, True)
    # Fold 11 stands for the choice by all trials.
    assert folds_near(0, 2, 11) == [1, 2, 10]
    assert folds_near(11, 2, 11) == [0, 1, 9, 10]
    assert {(0, 0), (0, 1), (0, 2), (0, 10)} <= set(steps[0][1])
    assert not {(0, 3), (5, 5)} & set(steps[0][1])


def test_few_folds_are_one_step():
    assert rungs(5, nested=True) == [(5, fold_pairs(5, True))]


@pytest.fixture(scope="module")
def vectors():
    """Trials that the first feature tells, the second at times, the third never."""
    rng = np.random.default_rng(5)
    y = np.array(["a", "b"])[rng.integers(0, 2, 220)]
    X = rng.normal(size=(220, 6))
    X[:, :2] += 3.0 * (y == "a")[:, None]
    X[:, 2:4] += 1.5 * (y == "a")[:, None]
    return Vectors(X, {"t": y}, ("max_force", "contact_area", "contact_motion"))


def test_a_grid_that_is_dropped_is_fitted_no_further(vectors):
    table = evaluate(vectors, FOLDS, GRIDS, halving=Halving(by_price))
    running = table.running["t"]
    assert running[:, :2].all()
    assert not running[:, 4:].any()
    # A fit that no choice of a running candidate needs is not made: all count as wrong.
    assert not table.right["t"][0][4:, FOLDS == 5].any()
    assert table.nested("t", 0)[:2].mean() > 0.9
    assert not table.nested("t", 0)[4:].any()


def test_what_is_dropped_without_a_fold_does_not_depend_on_its_labels(vectors):
    labels = vectors.y["t"].copy()
    labels[FOLDS == 3] = np.where(labels[FOLDS == 3] == "a", "b", "a")
    changed = replace(vectors, y={"t": labels})
    running, afterwards = (
        evaluate(v, FOLDS, GRIDS, halving=Halving(by_price)).running["t"]
        for v in (vectors, changed)
    )
    assert (running[3] == afterwards[3]).all()


def test_tasks_that_share_their_settings_drop_what_is_behind_in_their_mean(vectors):
    """The second task's labels follow from no feature."""
    chance = np.array(["x", "y"])[np.arange(220) % 2]
    of_two = replace(vectors, y={"t": vectors.y["t"], "u": chance})
    halving = Halving(lambda task, choices: Rule(), sharing=("t", "u"))
    table = evaluate(of_two, FOLDS, GRIDS, halving=halving)
    assert (table.running["t"] == table.running["u"]).all()
    assert table.running["t"][:, :2].all()
    assert not table.running["t"][:, 4:].all()
