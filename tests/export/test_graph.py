"""What the ONNX graph shares, and where small differences end."""

from collections import Counter

import numpy as np
import onnx
import pytest

from edge.decide.model import Model
from export.graph import to_onnx
from tests.checks.hard_cases.models import describe, features, labels_for
from train.model.pipeline import Choice, ContactClassifier


@pytest.fixture
def export(tmp_path):
    """Fit and export; returns the loaded model."""

    def run(X, choices):
        y = {task: labels_for(X, 5, seed) for seed, task in enumerate(choices)}
        fitted = ContactClassifier(choices).fit(X, y)
        path = tmp_path / "model.onnx"
        path.write_bytes(to_onnx(fitted, describe(fitted)))
        return Model(path)

    return run


def test_an_ulp_more_in_every_feature_changes_no_bit(export):
    """A difference of an ulp is lost when features are rounded to steps."""
    X = features(60)
    queries = features(300, seed=1)
    model = export(X, {"t": Choice("IV", 6, 5)})
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


def test_tasks_of_one_space_share_its_projection_and_rows(export):
    model = export(features(50), OF_TWO_SPACES)
    proto = onnx.load(model.path)
    operators = Counter(node.op_type for node in proto.graph.node)
    assert operators["MatMul"] == 2  # projections: scaling IV, none
    assert operators["Gemm"] == 3  # distances: of a and d, of b, of c
    shapes = [tuple(tensor.dims) for tensor in proto.graph.initializer]
    matrices = Counter(shape for shape in shapes if len(shape) == 2)
    weights = {(120, 7): 1, (120, 20): 1}
    rows = {(7, 50): 1, (20, 50): 1}
    ballots = {(6, 5): 1}
    assert matrices == weights | rows | ballots
    (opset,) = proto.opset_import
    assert opset.domain == ""
