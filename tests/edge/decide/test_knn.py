"""A decision has the same bits by whole numbers, estimators, ONNX Runtime, numpy and
C."""

from typing import NamedTuple

import numpy as np
import pytest
from onnxruntime import GraphOptimizationLevel

from edge.decide.info import OutlierLimits
from edge.decide.model import Model
from export.graph import to_onnx
from tests.checks.hard_cases import exact
from tests.checks.hard_cases.models import describe, labels_for, session
from tests.edge.decide.test_info import stopping
from tests.export.microcontroller.comparison import assert_same, needs_gcc
from train.model.outlier_score import OutlierSpace
from train.model.pipeline import Choice, ContactClassifier, vote
from train.model.scaling import SCALINGS
from train.model.stopping import SequentialClassifier

KINDS = (
    "plain",
    "lattice",
    "duplicates",
    "offset",
    "outlier",
    "far",
    "same",
    "dominated",
    "denormal",
)
SAMPLES = 8
FEATURES = ((), ("contact_area",), ("max_force", "contact_motion"))
OPTIMISED = GraphOptimizationLevel.ORT_ENABLE_ALL
POINTS_S = (0.4, 0.8, 1.2)


def hard_set(kind, rng):
    """(X, queries) with 24 columns of a kind that is hard for arithmetic that
    rounds."""
    n = int(rng.choice([4, 11, 40, 130]))
    X = rng.normal(size=(n, 24)) * 10.0 ** rng.uniform(-6, 6)
    queries = rng.normal(size=(8, 24)) * np.abs(X).max()
    if kind == "lattice":
        X = rng.integers(-2, 3, (n, 3)) @ rng.integers(-1, 2, (3, 24)).astype(
            np.float64
        )
        queries = np.concatenate([X[:4], (X[:4] + X[-4:]) / 2.0])
    elif kind == "duplicates":
        X = X[rng.integers(0, max(n // 3, 1), n)]
        queries = X[:4] * (1.0 + 1e-7 * rng.normal(size=(4, 24)))
    elif kind == "offset":
        offset = 1e9 * np.abs(X).max()
        X += offset
        queries += offset
    elif kind == "outlier":
        X[0] *= 1e5
    elif kind == "same":
        X[:] = X[0]
    elif kind == "dominated":
        X[:, :8] = np.rint(2.0 * rng.random((n, 8))) * 1e12 * np.abs(X).max()
    elif kind == "denormal":
        X[:, ::3] = rng.integers(0, 50, (n, 8)) * 5e-324
    elif kind == "far":
        queries *= 10.0 ** rng.uniform(0, 140, (8, 1))
    return X, np.concatenate([X[:2], queries])


def hostile(width, rng, count=24, X=None):
    """Vectors of every kind: trained ones X, blends of two and what lies beyond them,
    an ulp beside these, and some with a number that is huge, tiny, infinite or none."""
    X = rng.normal(size=(8, width)) if X is None else X
    first, second = X[rng.integers(0, len(X), (2, count))]
    weights = rng.choice([0.0, 0.5, 1.0, 1.5, -1e4, 1e30], (count, 1))
    vectors = first + weights * (second - first)
    beside = np.nextafter(vectors, rng.choice([-np.inf, np.inf], vectors.shape))
    vectors = np.where(rng.random((count, 1)) < 0.3, beside, vectors)
    odd = rng.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 5e-324, -0.0], count)
    rows = np.flatnonzero(rng.random(count) < 0.2)
    vectors[rows, rng.integers(0, width, len(rows))] = odd[rows]
    return vectors


class Drawn(NamedTuple):
    """A model of hard vectors.

    Attributes:
        X: (decision points, n, p) that it was fitted on.
        y: {task: (n,) labels}.
        fitted: with or without decision points.
        queries: (m, p) hard vectors.
    """

    X: np.ndarray
    y: dict
    fitted: ContactClassifier | SequentialClassifier
    queries: np.ndarray

    @property
    def classifiers(self):
        """Of each decision point."""
        return getattr(self.fitted, "decision_points_", [self.fitted])

    def integers(self, point):
        """The oracle's outputs for the queries."""
        fitted = self.classifiers[point]
        answers = exact.outputs(fitted, self.X[point], self.y, self.queries)
        if len(self.X) > 1:
            answers |= exact.doubt(self.fitted.space_, point, self.queries)
        return answers

    def estimators(self, point):
        """The outputs of training's own code for the queries."""
        answers = {}
        for name, task in self.classifiers[point].tasks_.items():
            squares = task.squares(self.queries)
            labels = task.labels[task.nearest(squares)]
            distances, rows = task.neighbours(self.queries)
            answers |= {
                f"{name}_label": vote(labels),
                f"{name}_scores": np.eye(len(task.classes))[labels].mean(axis=1),
                f"{name}_distances": distances,
                f"{name}_neighbours": rows,
                f"{name}_label_distances": task.to_labels(squares) * task.slope,
            }
        if len(self.X) > 1:
            scores = self.fitted.space_.scores(np.stack([self.queries] * len(self.X)))
            answers |= {name: of[point] for name, of in scores._asdict().items()}
        return answers


def drawn(kind, count, seed):
    """A model with so many decision points. All trials may vote, each may have a label
    of its own, one task lacks labels, and three may belong together."""
    rng = np.random.default_rng(seed)
    X, queries = hard_set(kind, rng)
    labels = int(rng.integers(2, len(X) + 1))
    y = {"t": labels_for(X, labels), "some": labels_for(X, 3, seed)}
    y["some"][1::3] = ""
    if rng.random() < 0.5:
        y["mobility"] = labels_for(X, 2, 7)
        y["softness"] = np.char.add("s", labels_for(X, 2, 8))
        ends = np.char.add("-", y["mobility"])
        y["category"] = np.char.add(y["softness"], ends)

    def choices(k):
        return {
            task: Choice(
                str(rng.choice(SCALINGS)),
                int(rng.integers(1, 25)),
                k[task],
                str(rng.choice(["pca", "lda"])),
                features=FEATURES[rng.integers(3)],
            )
            for task in y
        }

    k = {task: int(rng.integers(1, len(X) // 2 + 1)) for task in y}
    stack = np.stack([X[::-1], 0.5 * (X + X[::-1]), X])[3 - count :]
    # The first two points may share their settings.
    early = choices(k)
    at_points = [early, early if seed % 2 else choices(k), choices(k)][3 - count :]
    fits = [
        ContactClassifier(choice).fit(x, y)
        for choice, x in zip(at_points, stack, strict=True)
    ]
    if count == 1:
        return Drawn(stack, y, fits[0], queries)
    fitted = SequentialClassifier(at_points[-1], POINTS_S)
    fitted.decision_points_ = fits
    fitted.space_ = OutlierSpace.of(stack, y["t"], [SAMPLES] * 3)
    fitted.stopping_ = dict.fromkeys(y, stopping())
    fitted.outlier_score_ = OutlierLimits((1.0,) * 3, (2.0,) * 3)
    return Drawn(stack, y, fitted, queries)


def assert_equal(answers, expected):
    """Each answer that is expected has its bits."""
    for name in answers.keys() & expected.keys():
        assert answers[name].dtype == expected[name].dtype, name
        assert answers[name].tobytes() == expected[name].tobytes(), name


def one_by_one(model, vectors, point):
    """The outputs for vectors that a model is given alone."""
    rows = [model.run(vector[None], point) for vector in vectors]
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}


def assert_alike(runtime, numpy, vectors, point):
    """Two engines refuse the same vectors, and answer the others with the same bits,
    whether they come one by one or together."""
    expected = one_by_one(runtime, vectors, point)
    answers = numpy.run(vectors, point)
    assert answers.keys() == expected.keys()
    labels = [f"{task}_label" for task in runtime.info.tasks]
    assert_equal({name: answers[name] for name in labels}, expected)
    finite = np.isfinite(vectors).all(axis=1)
    assert (np.array([expected[name] for name in labels])[:, ~finite] == -1).all()
    answered = np.min([expected[name] for name in labels], axis=0) >= 0
    for name, values in expected.items():
        assert answers[name][answered].tobytes() == values[answered].tobytes(), name


@pytest.mark.parametrize("seed", [1, 2, 4, 6])
def test_every_output_has_the_bits_of_whole_numbers(tmp_path, seed):
    assert_bits(tmp_path, seed)


@pytest.mark.slow
@needs_gcc
@pytest.mark.parametrize("seed", range(6, 18))
def test_so_it_has_in_c(tmp_path, seed):
    model, vectors = assert_bits(tmp_path, seed)
    assert_same(model, tmp_path / "c", [], vectors)


def assert_bits(folder, seed):
    """Compare all but C, which then is given the same model and vectors."""
    count = (1, 3)[seed % 2]
    model = drawn(KINDS[seed % len(KINDS)], count, seed)
    path = folder / "model.onnx"
    path.write_bytes(to_onnx(model.fitted, describe(model.fitted, samples=SAMPLES)))
    runtime = Model(path, "onnxruntime")
    rng = np.random.default_rng(seed)
    vectors = np.concatenate([model.queries, hostile(24, rng, 60, model.X[-1])])
    optimised = session(path.read_bytes(), OPTIMISED, threads=2)
    names = list(runtime.info.outputs)
    for point in range(count):
        expected = model.integers(point)
        answers = runtime.run(model.queries, point)
        assert answers.keys() <= expected.keys()
        assert_equal(answers, expected)
        assert_equal(answers, model.estimators(point))
        inputs = {"features": model.queries, "decision_point": np.array([point])}
        values = optimised.run(names, dict(list(inputs.items())[:count]))
        assert_equal(dict(zip(names, values, strict=True)), expected)
        assert_alike(runtime, Model(path, "numpy"), vectors, point)
    return runtime, vectors
