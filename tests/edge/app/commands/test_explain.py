"""`edge-classify explain`: the nearest trials by name, and what pulls."""

from dataclasses import replace

import numpy as np
import pytest

from edge.app.commands.explain import Explanation, Near, Space, explain
from tests.sequential import fitted_model
from train.model.pipeline import Choice


def test_a_program_gets_the_trials_by_name_and_the_parts(edge, exported, recordings):
    words = (exported / "model.onnx", recordings / "hard_0.npz")
    status, (category, about_object), _ = edge("explain", *words)
    assert status == 0
    assert edge("explain", "--model", *words)[1] == [category, about_object]
    assert about_object["task"] == "object"
    assert category["task"] == "category"
    assert category["label"] == "rigid-fixed"
    # The touch itself was trained with.
    assert category["nearest"][0]["trial"] == "hard_0"
    assert category["nearest"][0]["distance"] == pytest.approx(0.0, abs=1e-5)
    assert category["rival"]["trial"].startswith("soft_")
    assert category["rival"]["label"] == "soft-fixed"


def test_a_person_gets_lines_that_fit(edge, exported, recordings, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    words = (exported / "model.onnx", recordings / "soft_1.npz")
    status, out, _ = edge("explain", *words, text=True)
    assert status == 0
    assert "category: soft-fixed, by " in out
    assert "  soft_1: soft-fixed\n" in out
    assert ": rigid-fixed\n  It is more like soft-fixed in " in out
    assert max(map(len, out.splitlines()[1:])) <= 80


def test_what_cannot_be_explained_is_one_sentence(exported, quiet, refused):
    err = refused("explain", exported / "model.onnx")
    assert "and the recordings to explain" in err
    err = refused("explain", exported / "model.onnx", quiet)
    assert "quiet.npz: holds no contact; leave it out" in err


BY_HAND = Space(
    columns=np.arange(3),
    mean=np.array([10.0, 10.0, 0.0]),
    gain=np.array([0.5, 0.5, 2.0]),
    weights=np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
    rows=np.array([[2.0, 0.0], [-2.0, 0.0]]),
    labels=np.array([0, 1]),
)
"""Two trials, of a force with two samples and of an area, which stand on either side of
a mean."""


def by_hand(space=BY_HAND, voters=(0,)):
    touch = np.array([11.0, 12.0, 0.25])
    return explain(space, touch, voters, 0, ["force", "area"], [2, 1])


def test_distance_and_pulls_are_those_worked_out_by_hand():
    why = by_hand()
    # z = (0.5 + 1, 0.5); to (2, 0): 0.25 + 0.25 = |z|^2 + |b|^2 - 6 = 2.5 + 4 - 6.
    assert why.voters == (Near(0, 0, np.sqrt(0.5), {"force": 6.0, "area": 0.0}),)
    assert why.rival == Near(1, 1, np.sqrt(12.5), {"force": -6.0, "area": 0.0})
    assert why.pulls == {"force": 12.0, "area": 0.0}


def test_a_trial_without_a_label_is_no_rival():
    assert by_hand(BY_HAND._replace(labels=np.array([0, -1]))).rival is None


def test_a_task_is_explained_by_its_own_columns_and_trials_at_the_full_window(
    model, tmp_path
):
    """Three decision points; one task takes one feature, the other lacks labels."""
    info = replace(model.info, decision_points_s=(0.3, 0.6, 1.2))
    choices = {
        "of_area": Choice("none", 4, 3, features=("contact_area",)),
        "partial": Choice("none", 4, 3),
    }
    rng = np.random.default_rng(0)
    X = rng.normal(size=(3, 60, info.width))
    vectors = rng.normal(size=(9, info.width))
    vectors[-1] *= 1e3  # beyond the reach of features and coordinates
    y = {
        "of_area": np.array(["a", "b", "c"] * 20),
        "partial": np.array(["d", "e", "", "d"] * 15),
    }
    _, model = fitted_model(tmp_path / "model.onnx", info, choices, X, y)
    assert model.decide(vectors[-1])["partial"].out_of_range
    for name, task in model.info.tasks.items():
        space = Space.of(model, name)
        for vector in vectors:
            decision = model.decide(vector)[name]
            answer = task.labels.index(decision.label)
            rows = decision.neighbours.tolist()
            why = explain(space, vector, rows, answer, info.features, info.widths)
            distances = [near.distance for near in why.voters]
            assert distances == pytest.approx(decision.distances.tolist(), abs=1e-5)
            assert why.rival.label != answer
            for near in (*why.voters, why.rival):
                assert task.labels[near.label] == y[name][near.row]


def test_without_another_label_there_is_no_rival():
    why = by_hand(BY_HAND._replace(labels=np.array([0, 0])), voters=[1])
    pulls = {"force": -6.0, "area": 0.0}
    assert why == Explanation((Near(1, 0, np.sqrt(12.5), pulls),), None, {})
