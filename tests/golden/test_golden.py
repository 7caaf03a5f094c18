"""The edge against the committed golden outputs, made once on another day and
machine."""

from pathlib import Path

import numpy as np
import pytest

from edge.decide.model import Model
from edge.decide.verify import verify

HERE = Path(__file__).parent


@pytest.fixture(scope="module")
def checks():
    return {c.name: c for c in verify(Model(HERE / "model.onnx"), HERE / "golden.npz")}


def test_every_quantity_of_the_path_and_of_the_graph_is_met(checks):
    assert [c.name for c in checks.values() if not c.passed] == []
    # The last one, out_of_range, belongs to no task.
    assert len(checks) == 4 + 3 * 4 + 1
    assert (
        min(checks[name].rows for name in ("object_label", "mobility_neighbours")) > 40
    )
    assert checks["series counts"].rows > 500


def test_the_committed_cases_are_hard_enough_to_tell():
    """Votes tie, some vectors are not finite, and several labels occur."""
    golden = np.load(HERE / "golden.npz")
    labels = golden["object_label"]
    assert (labels[-2:] == -1).all()
    assert len(np.unique(labels)) >= 5
    scores = golden["object_scores"][:-2]
    assert ((scores == scores.max(axis=1, keepdims=True)).sum(axis=1) > 1).any()
