"""A model that decides at several points of time, fitted on vectors of a test."""

from edge.decide.model import Model
from export.graph import to_onnx
from tests.checks.hard_cases.models import describe
from train.data.folds import stratified_folds
from train.model.stopping import SequentialClassifier


def fitted_model(path, info, choices, X, y, early=None):
    """The estimator, and its model, which is written to a path.

    `info` is the metadata of a model of the same features; X has a set of vectors for
    each of its decision points, and the first task of y gives the folds.
    """
    estimator = SequentialClassifier(
        choices,
        info.decision_points_s,
        info.features,
        early=early,
    )
    estimator.fit(X, y, stratified_folds(next(iter(y.values()))), [choices] * 10)
    path.write_bytes(to_onnx(estimator, describe(estimator, info, info.samples)))
    return estimator, Model(path)
