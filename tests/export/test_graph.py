"""The ONNX graph against Python's whole numbers, the estimators and ONNX's own
reference."""

from collections import Counter

import numpy as np
import onnx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from onnx.reference import ReferenceEvaluator

from edge.decide import onnx_file
from edge.decide.graph import Graph
from edge.decide.model import Model
from export.graph import to_onnx
from tests.checks.hard_cases import exact
from tests.checks.hard_cases.models import describe, features, labels_for, session
from tests.conftest import sealed
from train.model.pipeline import Choice, ContactClassifier, vote
from train.model.scaling import SCALINGS


def fit(X, choices, labels=5, lack=()):
    """Fitted on labels that every third trial lacks for some of the tasks."""
    y = {task: labels_for(X, labels, seed) for seed, task in enumerate(choices)}
    for task in lack:
        y[task][::3] = ""
    return ContactClassifier(choices).fit(X, y)


@pytest.fixture
def export(tmp_path):
    """Fit and export; returns the classifier and the loaded model."""

    def run(X, choices):
        fitted = fit(X, choices)
        path = tmp_path / "model.onnx"
        path.write_bytes(to_onnx(fitted, describe(fitted)))
        return fitted, Model(path)

    return run


def differences(fitted, answers, queries):
    """Names of the graph's outputs that are not the estimators' answers, bit for
    bit."""
    wrong = []
    for task in fitted.choices:
        distances, rows = fitted.tasks_[task].neighbours(queries)
        nearest = fitted.tasks_[task].nearest(fitted.tasks_[task].squares(queries))
        labels = fitted.tasks_[task].labels[nearest]
        expected = {
            f"{task}_neighbours": rows,
            f"{task}_label": vote(labels),
            f"{task}_scores": np.eye(len(fitted.tasks_[task].classes))[labels].mean(
                axis=1
            ),
            f"{task}_distances": distances,
        }
        for name, values in expected.items():
            if not np.array_equal(answers[name], values):
                wrong.append(name)
    return wrong


def hard_set(kind, draw):
    """(X, queries) with 24 columns of a kind that is hard for arithmetic that
    rounds."""
    n = int(draw.integers(4, 40))
    X = draw.normal(size=(n, 24)) * 10.0 ** draw.uniform(-6, 6)
    queries = draw.normal(size=(8, 24)) * np.abs(X).max()
    if kind == "lattice":
        X = draw.integers(-2, 3, (n, 3)) @ draw.integers(-1, 2, (3, 24)).astype(
            np.float64
        )
        queries = np.concatenate([X[:4], (X[:4] + X[-4:]) / 2.0])
    elif kind == "duplicates":
        X = X[draw.integers(0, max(n // 3, 1), n)]
        queries = X[:4] * (1.0 + 1e-7 * draw.normal(size=(min(n, 4), 24)))
    elif kind == "offset":
        offset = 1e9 * np.abs(X).max()
        X += offset
        queries += offset
    elif kind == "outlier":
        X[0] *= 1e5
    elif kind == "far":
        queries *= 10.0 ** draw.uniform(0, 9, (len(queries), 1))
    return X, queries


def by_hand(fitted, rows, points, k):
    """The answers to points in whole numbers (m, c), from rows (n, c)."""
    unit = fitted.tasks_["t"].unit
    answers = {"distances": [], "neighbours": [], "label": []}
    for point in points:
        nearest, squares = exact.nearest(rows, point, k)
        assert max(squares) < 2**53
        answers["distances"].append([exact.distance(squares[j], unit) for j in nearest])
        answers["neighbours"].append(nearest)
        voters = fitted.tasks_["t"].labels[nearest].tolist()
        answers["label"].append(exact.winner(voters))
    return answers


def same_of_all_engines(data, outputs, queries):
    """The outputs of a model file, which are the same bits in each engine."""
    numpy_graph = Graph(onnx_file.read(data, "the graph"))
    ours, *others = (
        engine.run(outputs, {"features": queries})
        for engine in (session(data), ReferenceEvaluator(data), numpy_graph)
    )
    for name, values, *of_others in zip(outputs, ours, *others, strict=True):
        for of_another in of_others:
            assert values.tobytes() == of_another.tobytes(), name
    return ours


def coordinates_of(graph):
    """The name of the coordinates, which become an output; the last Clip gives them."""
    *_, last = (node for node in graph.node if node.op_type == "Clip")
    (name,) = last.output
    graph.output.append(onnx.helper.make_empty_tensor_value_info(name))
    return name


@settings(max_examples=60, deadline=None)
@given(
    kind=st.sampled_from("plain lattice duplicates offset outlier far".split()),
    projection=st.sampled_from(["pca", "lda"]),
    scaling=st.sampled_from(SCALINGS),
    k=st.integers(1, 40),
    seed=st.integers(0, 10**6),
)
def test_every_number_of_the_graph_is_that_of_whole_numbers(
    kind,
    projection,
    scaling,
    k,
    seed,
):
    """Coordinates, squared distances, neighbours and labels, by three engines and
    by training."""
    X, queries = hard_set(kind, np.random.default_rng(seed))
    k = min(len(X), k)
    fitted = fit(X, {"t": Choice(scaling, 6, k, projection)}, labels=4)
    data = to_onnx(fitted, describe(fitted, samples=8))
    proto = onnx.load_from_string(data)
    z_name = coordinates_of(proto.graph)
    task_fit = fitted.tasks_["t"]
    p = task_fit.space.projection
    c = task_fit.components
    rows = exact.coordinates(X, p, c)
    points = exact.coordinates(queries, p, c)
    expected = by_hand(fitted, rows, points, k)
    assert (task_fit.rows / p.grid_.unit).tolist() == rows.tolist()
    outputs = [z_name, *(f"t_{name}" for name in expected), "t_scores", "out_of_range"]
    z, *answers, scores, cut = same_of_all_engines(sealed(proto), outputs, queries)
    assert cut.tolist() == exact.projected(queries, p).cut.tolist()
    assert z[:, :c].tolist() == points.tolist()
    for (name, values), numbers in zip(expected.items(), answers, strict=True):
        assert numbers.tolist() == values, name
    named = dict(zip(outputs, [z, *answers, scores, cut], strict=True))
    assert differences(fitted, named, queries) == []


def test_an_ulp_more_in_every_feature_changes_no_bit(export):
    """A difference of an ulp is lost when features are rounded to steps."""
    X = features(60)
    queries = features(300, seed=1)
    _, model = export(X, {"t": Choice("IV", 6, 5)})
    answers = model.run(queries)
    moved = model.run(np.nextafter(queries, np.inf))
    for name, values in answers.items():
        assert values.tobytes() == moved[name].tobytes(), name


OF_TWO_SPACES = {
    "a": Choice("IV", 20, 2),
    "b": Choice("IV", 3, 4),
    "c": Choice("none", 7, 1),
    "d": Choice("IV", 20, 5),
}
"""Tasks of which three share a space."""


def test_tasks_of_one_space_share_its_projection_but_not_their_rows(export):
    _, model = export(features(50), OF_TWO_SPACES)
    proto = onnx.load(model.path)
    operators = Counter(node.op_type for node in proto.graph.node)
    assert operators["MatMul"] == 2  # projections: scaling IV, none
    assert operators["Gemm"] == 4  # distances
    shapes = [tuple(tensor.dims) for tensor in proto.graph.initializer]
    matrices = Counter(shape for shape in shapes if len(shape) == 2)
    weights = {(120, 7): 1, (120, 20): 1}
    rows = {(7, 50): 1, (20, 50): 3}
    ballots = {(6, 5): 1}
    assert matrices == weights | rows | ballots
    (opset,) = proto.opset_import
    assert opset.domain == ""
