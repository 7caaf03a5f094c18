"""Models of the project and of the usual stack on the same training vectors."""

import tempfile
from dataclasses import replace
from functools import cache, cached_property
from pathlib import Path

import numpy as np
import onnxruntime
from skl2onnx import to_onnx as convert
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline

from edge import demo
from edge.decide.info import Task
from edge.decide.model import Model
from export.graph import to_onnx
from tests.checks.hard_cases import exact
from train.model.pipeline import Choice, ContactClassifier

USUAL = Choice("none", 6, 5)


def features(n, seed=0):
    """(n, 120) vectors with the scales of force, area and motion."""
    rng = np.random.default_rng(seed)
    X = rng.gamma(2.0, size=(n, 120))
    X[:, 40:80] *= 30.0
    X[:, 80:] *= 0.02
    return X


@cache
def shipped():
    """The model that comes with the program."""
    return Model(demo.MODEL)


def describe(fitted, info=None, samples=40):
    """The metadata of a model that was fitted on vectors alone, with or without
    decision points; all else is that of `info`, or of the shipped model."""
    last = getattr(fitted, "decision_points_", [fitted])[-1]
    tasks = {
        task: Task(
            tuple(map(str, last.tasks_[task].classes)),
            choice.k,
            last.tasks_[task].components,
            choice.scaling,
            0.0,
            features=choice.features,
            factors=fitted.joint_tasks_.get(task, {}),
        )
        for task, choice in fitted.choices.items()
    }
    return replace(
        info or shipped().info,
        tasks=tasks,
        samples=samples,
        rows=last.n_rows_,
        trials=(),
        decision_points_s=tuple(getattr(fitted, "decision_points_s", ())),
        stopping=getattr(fitted, "stopping_", {}),
        outlier_score=getattr(fitted, "outlier_score_", None),
    )


def exported(fitted, *of_metadata):
    """The bytes and the model of a fitted estimator; see `describe`."""
    data = to_onnx(fitted, describe(fitted, *of_metadata))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.onnx"
        path.write_bytes(data)
        return data, Model(path)


def labels_for(X, classes=5, seed=0):
    """Labels that have nothing to do with the vectors: classes overlap, votes tie."""
    rng = np.random.default_rng([seed, 77])
    return np.array([f"c{i:04d}" for i in rng.integers(0, classes, len(X))])


def one_by_one(model, vectors, *point):
    """A model's answers to vectors one by one, as the board asks, at a decision
    point."""
    answers = [model.run(vector[None], *point) for vector in vectors]
    return {key: np.concatenate([a[key] for a in answers]) for key in answers[0]}


class Ours:
    """A fitted classifier of one task, its exported graph, and the oracle of the
    two."""

    def __init__(self, X, y=None, choice=USUAL):
        y = labels_for(X) if y is None else y
        self.fitted = ContactClassifier({"t": choice}).fit(X, {"t": y})
        self.data, self.model = exported(self.fitted, None, X.shape[1] // 3)
        self.k = choice.k
        self.labels = self.fitted.tasks_["t"].labels.tolist()
        self.projection = self.fitted.tasks_["t"].space.projection
        self._X = X

    @cached_property
    def rows(self):
        """The exact coordinates of the training vectors."""
        return self.whole(self._X)

    def whole(self, vectors):
        """The exact coordinates of vectors."""
        return exact.coordinates(
            vectors, self.projection, self.fitted.tasks_["t"].components
        )

    def alone(self, queries):
        """The graph's answers to queries one by one, as the board asks."""
        answers = one_by_one(self.model, queries)
        return {name.removeprefix("t_"): answers[name] for name in answers}

    def wrong(self, queries):
        """Queries whose neighbours, order, label or a bit of a distance is not the
        oracle's."""
        answers = self.alone(queries)
        wrong = 0
        for i, point in enumerate(self.whole(queries)):
            near, squares = exact.nearest(self.rows, point, self.k)
            unit = self.projection.grid_.unit
            expected = {
                "neighbours": near,
                "label": exact.winner([self.labels[j] for j in near]),
                "distances": [exact.distance(squares[j], unit) for j in near],
            }
            wrong += any(answers[k][i].tolist() != v for k, v in expected.items())
        return wrong


def session(data, level=None, threads=1):
    """A session of ONNX Runtime."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 4
    if level is not None:
        options.graph_optimization_level = level
    return onnxruntime.InferenceSession(
        data,
        options,
        providers=["CPUExecutionProvider"],
    )


def converted(pipe, queries):
    """The answers of the default skl2onnx conversion: float32 in, its own k-NN."""
    vectors = queries.astype(np.float32)
    proto = convert(pipe, vectors[:1], options={"zipmap": False})
    theirs = session(proto.SerializeToString())
    return np.ravel(theirs.run(None, {"X": vectors})[0])


def usual_neighbours(X, queries):
    """Shares of nearest rows that are not those of exact arithmetic without any
    rounding: of scikit-learn's PCA and k-NN, by brute force, and of ours."""
    n = len(X)
    pca = PCA(6, random_state=0)
    pipe = make_pipeline(pca, KNeighborsClassifier(1, algorithm="brute"))
    pipe.fit(X, np.arange(n))
    vectors = np.concatenate([X, queries])
    points = exact.unrounded(vectors, pca.mean_, pca.components_.T)
    truth = [exact.nearest(points[:n], point, 1)[0][0] for point in points[n:]]
    ours = Ours(X, choice=Choice("none", 6, 1))
    answers = {
        "scikit-learn": pipe.predict(queries),
        "skl2onnx": converted(pipe, queries),
        "ours, on its grid": ours.alone(queries)["neighbours"][:, 0],
    }
    shares = ", ".join(
        f"{name} {np.mean(v != truth):.0%}" for name, v in answers.items()
    )
    return f"wrong nearest: {shares}"
