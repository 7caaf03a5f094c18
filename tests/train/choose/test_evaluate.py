"""Nested accuracy against doing it the long way with the exported estimators."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from edge.decide.statistics import wilson
from edge.errors import InputError
from train.choose.evaluate import (
    AnswerTable,
    NestedAccuracy,
    Result,
    evaluate,
)
from train.choose.protocols import Protocol
from train.choose.rule import MOST_ACCURATE, Rule
from train.choose.search import SearchGrid
from train.data.folds import stratified_folds
from train.data.vectors import Vectors
from train.model.pipeline import Choice, ContactClassifier

TWO = ("max_force", "contact_area")
GRIDS = (
    SearchGrid("IV", "lda", shrinkages=(1.0, 0.01), neighbours=(1, 3)),
    SearchGrid("none", "pca", components=(1, 4, 30), neighbours=(1, 3)),
    SearchGrid("IV", "pca", ("contact_area",), components=(2,), neighbours=(5,)),
)


def by_trial(table):
    """The most accurate choice by a table's answers."""
    return Protocol(table, lambda *_: MOST_ACCURATE)


def trials(n=36, seed=0):
    """Two feature types of which both tell a little."""
    rng = np.random.default_rng(seed)
    y = np.array(["a", "b", "c"])[np.arange(n) % 3]
    X = rng.normal(size=(n, 12))
    X[:, :6] += np.where(y == "a", 1.0, 0.0)[:, None]
    X[:, 6:] = X[:, 6:] * 50 + np.where(y == "b", 60.0, 0.0)[:, None]
    return Vectors(X, {"t": y}, TWO)


def told_right(choice, vectors, train, test):
    """Whether the classifier that is exported tells the tests; both are masks."""
    model = ContactClassifier.of({"t": choice}, vectors.part(train))
    labels = model.decide(vectors.X[test])["t"].labels
    return model.tasks_["t"].classes[labels] == vectors.y["t"][test]


def assert_exported(table, fold, vectors, train, test):
    """The candidates' answers by a fit without a fold are those of the classifier that
    is exported."""
    answers = table.right["t"][fold][:, test]
    for choice, right in zip(table.choices["t"], answers, strict=True):
        assert (right == told_right(choice, vectors, train, test)).all()


def test_every_answer_is_that_of_the_exported_estimators():
    vectors = trials()
    folds = stratified_folds(vectors.y["t"], 4)
    table = evaluate(vectors, folds, GRIDS)
    assert len(table.choices["t"]) == 4 + 6 + 1
    for i, j in product(range(4), repeat=2):
        train = (folds != i) & (folds != j)
        assert_exported(table, i, vectors, train, folds == j)


@pytest.mark.parametrize("seed", [0, 4, 7])
def test_trials_that_are_equal_tie_as_in_the_exported_estimators(seed):
    """Each trial has a twin of another label: the earlier of equally near ones
    decides."""
    folds = np.repeat(np.arange(6) % 3, 2)
    y = np.array(["a", "b", "b", "c", "c", "a"] * 2)
    grids = [replace(grid, neighbours=(1, 2)) for grid in GRIDS]
    X = np.repeat(trials(6, seed).X, 2, axis=0) * 10.0 ** (seed - 4)
    vectors = Vectors(X, {"t": y}, TWO)
    table = evaluate(vectors, folds, grids)
    for fold in range(3):
        assert_exported(table, fold, vectors, folds != fold, folds == fold)


def test_trials_without_a_label_or_a_fold_are_not_tested():
    vectors = trials()
    vectors.y["t"][::5] = ""
    numbers = np.arange(36)
    folds = np.where(numbers % 2 == 0, numbers // 2 % 3, -1)
    table = evaluate(vectors, folds, GRIDS)
    tested = (folds >= 0) & (vectors.y["t"] != "")
    assert (table.tested["t"] == tested).all()
    assert by_trial(table).accuracy("t").total == tested.sum()
    for fold in range(3):
        test = tested & (folds == fold)
        assert_exported(table, fold, vectors, folds != fold, test)


def test_nested_accuracy_is_that_of_choosing_anew_without_each_fold():
    vectors = trials()
    folds = stratified_folds(vectors.y["t"], 4)
    table = evaluate(vectors, folds, GRIDS)
    right = 0
    for fold in range(4):
        answers = table.right["t"][fold]
        best = answers[:, folds != fold].sum(axis=1).argmax()
        right += answers[best, folds == fold].sum()
    assert by_trial(table).accuracy("t").right == right


def test_a_promise_is_as_wide_as_two_fifths_of_its_trials_make_it():
    assert Result(90, 100).interval == wilson(90, 100)
    assert NestedAccuracy(90, 100).interval == wilson(36, 40)
    assert NestedAccuracy(90, 100, variance=10.0).interval == wilson(9, 10)


@pytest.mark.parametrize("most", [None, 2])
def test_the_discriminants_of_two_tasks_may_be_set_side_by_side(most):
    """All of them, or the first of them."""
    y = trials().y["t"]
    labels = {"t": y, "u": np.where(y == "a", "yes", "no")}
    vectors = replace(trials(), y=labels)
    grid = SearchGrid(
        "IV",
        "lda",
        shrinkages=(0.1,),
        neighbours=(1,),
        targets=("t", "u"),
        most_directions=most,
    )
    table = evaluate(vectors, stratified_folds(y, 4), [grid])
    (choice,) = table.choices["t"]
    assert choice.components == (most or 2 + 1)
    assert_exported(table, 0, vectors, table.folds != 0, table.folds == 0)


def test_further_divisions_count_in_the_choice_by_all_trials_alone():
    """By the first division the first candidate is better, by both the second."""
    first = np.array([[True, True, True, False], [True, True, False, False]])
    second = np.array([[False, False, False, False], [True, True, True, True]])
    folds = np.arange(4) % 2
    settings = [Choice("IV", 1, 1), Choice("IV", 1, 3)]

    def table(right, **repeated):
        return AnswerTable(
            folds,
            {"t": settings},
            {"t": np.stack([right] * 2)},
            **repeated,
        )

    repeated_table = table(first, repeated=(table(second),))
    assert repeated_table.plain("t").tolist() == [
        [0.5, 0.5, 0.5, 0.0],
        [1.0, 1.0, 0.5, 0.5],
    ]
    assert Rule().choose(repeated_table.plain("t")) == 1
    assert by_trial(repeated_table).places("t", MOST_ACCURATE) == [0, 0]
    assert by_trial(table(first)).places("t", MOST_ACCURATE) == [0, 0]


def test_of_graded_candidates_that_are_equally_right_the_clearer_is_chosen():
    vectors = trials()
    y = vectors.y["t"]
    # Both tell the labels in every trial; by the second feature type they are closer.
    X = np.zeros((36, 12))
    X[:, 0] = np.unique(y, return_inverse=True)[1]
    noise = np.random.default_rng(0).uniform(-0.2, 0.2, 36)
    X[:, 6] = X[:, 0] + noise
    blurred = SearchGrid("none", "pca", ("contact_area",), (1,), neighbours=(3,))
    clear = replace(blurred, features=("max_force",))
    graded = [replace(grid, graded=True) for grid in (blurred, clear)]
    folds = stratified_folds(y, 4)
    plain = evaluate(replace(vectors, X=X), folds, [blurred, clear])
    table = evaluate(replace(vectors, X=X), folds, graded)
    assert Rule().choose(plain.plain("t")) == 0
    assert Rule().choose(table.plain("t")) == 1
    assert by_trial(table).places("t", MOST_ACCURATE) == [1] * 4


def test_a_graded_answer_that_is_wrong_counts_as_wrong():
    vectors = trials()
    folds = stratified_folds(vectors.y["t"], 4)
    graded = [replace(grid, graded=True) for grid in GRIDS]
    plain = evaluate(vectors, folds, GRIDS)
    table = evaluate(vectors, folds, graded)
    assert 0 < plain.answered("t", [0] * 4).right < 36
    for candidate in range(len(plain.choices["t"])):
        places = [candidate] * 4
        assert table.answered("t", places) == plain.answered("t", places)


def test_what_cannot_be_parted_or_measured_is_one_sentence():
    vectors = trials()
    y = vectors.y["t"]
    with pytest.raises(InputError, match="at least 3 folds, not 2"):
        evaluate(vectors, stratified_folds(y, 2), GRIDS)
    vectors.X[5, 3] = np.nan
    with pytest.raises(InputError, match="trial 5 are not finite"):
        evaluate(vectors, stratified_folds(y, 3), GRIDS)
