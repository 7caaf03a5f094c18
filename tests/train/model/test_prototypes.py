"""Prototypes: rows at the means of many trials, and the trials next to them."""

import numpy as np
import pytest

from tests.checks.hard_cases.models import exported, features
from train.data.folds import stratified_folds
from train.data.vectors import MOST_ROWS, Vectors
from train.model.pipeline import Choice, ContactClassifier
from train.model.prototypes import counts_tried, divided
from train.model.stopping import SequentialClassifier

CHOICES = {
    "kind": Choice("none", 7, 1),
    "thing": Choice("none", 7, 1),
}


def touches(n):
    """Vectors of four objects, of which each lies at two places, and its place (n,)."""
    X = features(n)
    thing = np.arange(n) % 4
    place = 2 * thing + np.arange(n) // 4 % 2
    X[:, :8] += 200.0 * (place[:, None] == np.arange(8))
    y = {"kind": np.where(thing < 2, "soft", "rigid"), "thing": thing.astype(str)}
    return Vectors(X, y), place


def parts(vectors, count):
    """The prototypes of trials at one decision point."""
    at_points = Vectors(vectors.X[None], vectors.y)
    return divided(at_points, slice(None), [CHOICES], count, [{}])


@pytest.fixture(scope="module")
def model():
    """A model with two prototypes of each object, and its trials."""
    vectors, _ = touches(80)
    X = np.stack([vectors.X, vectors.X])
    folds = stratified_folds(vectors.y["thing"])
    fitted = SequentialClassifier(CHOICES, (0.6, 1.2), prototypes=2)
    return fitted.fit(X, vectors.y, folds, [CHOICES] * 10), vectors


def test_few_trials_are_rows_themselves():
    y = {"thing": np.arange(MOST_ROWS + 1) % 60}
    few = {"thing": y["thing"][:-1]}
    assert counts_tried({"thing": y["thing"].astype(str)}) == [1, 2, 4, 8]
    assert counts_tried({"thing": few["thing"].astype(str)}) == []


def test_a_prototype_is_the_mean_of_trials_with_the_same_labels():
    vectors, place = touches(80)
    of_trials = parts(vectors, 2)
    pairs = set(zip(of_trials.tolist(), place.tolist(), strict=True))
    assert len(pairs) == 8
    vectors = Vectors(vectors.X, vectors.y, prototypes=of_trials)
    space = ContactClassifier.of(CHOICES, vectors).tasks_["thing"].space
    coordinates = space.project(vectors.X)
    for prototype, row, trial in zip(
        space.members, space.rows, space.trials, strict=True
    ):
        mean = coordinates[of_trials == prototype].mean(axis=0)
        assert row == pytest.approx(mean, abs=space.projection.grid_.unit)
        away = np.linalg.norm(coordinates - row, axis=1)
        away[of_trials != prototype] = np.inf
        assert trial == away.argmin()


def test_equal_trials_make_one_prototype():
    vectors, _ = touches(40)
    vectors.X[:] = vectors.X[np.arange(40) % 4]
    assert sorted(set(parts(vectors, 3).tolist())) == [0, 1, 2, 3]


def test_the_file_answers_as_the_prototypes_do(model):
    fitted, vectors = model
    last = fitted.decision_points_[-1]
    assert last.n_rows_ == 8
    assert (vectors.y["thing"][last.trials_] == list("22330011")).all()
    _, onnx = exported(fitted)
    answers = onnx.run(vectors.X, 1)
    for task, decided in last.decide(vectors.X).items():
        assert (answers[f"{task}_label"] == decided.labels).all()
        assert (answers[f"{task}_label_distances"] == decided.distances).all()


def test_promises_are_made_by_prototypes_of_other_folds(model):
    fitted, vectors = model
    assert fitted.right_["thing"].all()
    folds = stratified_folds(vectors.y["thing"])
    others = SequentialClassifier(CHOICES, (0.6, 1.2))
    others.fit(np.stack([vectors.X] * 2), vectors.y, folds, [CHOICES] * 10)
    assert others.stopping_["thing"].slopes != fitted.stopping_["thing"].slopes
