"""A model that decides at several points of time, fitted on vectors of a test."""

from dataclasses import replace

from edge.model.info import Task
from edge.model.model import Model
from export.graph import to_onnx
from train.evaluate import stratified_folds
from train.stopping import SequentialClassifier


def fitted_model(path, info, choices, X, y, early=None):
    """The estimator, and its model, which is written to a path.

    `info` is the metadata of a model of the same features; X has a set of vectors for
    each of its decision points, and the first task of y gives the folds.
    """
    estimator = SequentialClassifier(
        choices, info.decision_points_s, info.features, early=early
    )
    estimator.fit(X, y, stratified_folds(next(iter(y.values()))), [choices] * 10)
    tasks = {
        task: Task(
            labels_of(y[task]), c.k, c.components, c.scaling, 0.5, features=c.features
        )
        for task, c in choices.items()
    }
    calibration = {"stopping": estimator.stopping_, "novelty": estimator.novelty_}
    info = replace(info, tasks=tasks, rows=X.shape[1], trials=(), **calibration)
    path.write_bytes(to_onnx(estimator, info))
    return estimator, Model(path)


def labels_of(y):
    """The labels of a task, without that of trials that have none."""
    return tuple(sorted({*y} - {""}))
