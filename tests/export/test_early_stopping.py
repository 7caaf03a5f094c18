"""The graph's distances to each label, and the board's stopping, against the estimators."""

import onnxruntime
import pytest

from edge.classifier import Classifier, stopping_rules
from edge.errors import InputError
from edge.model.model import Model
from edge.recording import save
from export.__main__ import main as export
from train.dataset import load_trials

POINTS = "0.3,0.6,1.2"
PAPER = ("--features", "paper", "--projection", "pca", "--samples", "40", "--jobs", "1")


@pytest.fixture(scope="module")
def early(make_touch, tmp_path_factory):
    """A model with decision points, and the recordings that it was fitted on."""
    folder = tmp_path_factory.mktemp("early")
    for kind in ("hard", "soft"):
        for seed in range(15):
            save(folder / "data" / f"{kind}_{seed:02d}.npz", make_touch(kind=kind, seed=seed))
    given = ["--data", str(folder / "data"), "--out", str(folder / "out"), *PAPER]
    assert export([*given, "--decision-points", POINTS, "--scaling", "IV"]) == 0
    return Model(folder / "out" / "model.onnx"), folder


def test_the_graph_measures_each_label_as_the_estimator_does(early):
    model, folder = early
    data = load_trials([folder / "data"])
    for point, window in enumerate(model.decision_points_s):
        X = 1.01 * data.features(window)
        given = model.run(X, point)
        for task, entry in model.info.tasks.items():
            distances = given[f"{task}_label_distances"]
            assert distances.shape == (len(X), len(entry.labels))
            # The nearest neighbour is no farther than the mean of its label's nearest.
            nearest = given[f"{task}_distances"][:, 0] ** 2
            assert (distances.min(axis=1) >= nearest * (1 - 1e-12)).all()


def test_the_board_stops_where_the_rule_does(early, make_touch):
    model, _ = early
    error = model.info.stopping["category"].smallest_error
    rule = stopping_rules(model, error)["category"]
    for seed in (50, 51, 52):
        recording = make_touch(kind="soft", seed=seed)
        classifier = Classifier(model, recording.layout, error=error)
        lines = [event.to_dict() for event in classifier.classify(recording)]
        (decision,) = (line for line in lines if line.get("task") == "category")
        assert decision["window_s"] in model.decision_points_s[: rule.last + 1]
        assert decision["stopped_by"] == ("window" if rule.fixed else "confidence")
        assert decision["error"] == error
        assert 0.0 <= decision["confidence"] <= 1.0


def test_an_error_that_no_task_certifies_is_refused_with_what_would_do(early):
    model, _ = early
    with pytest.raises(InputError, match="cannot be certified; category: the smallest error that"):
        Classifier(model, error=0.001)


def test_a_stranger_with_onnxruntime_alone_is_answered_at_the_full_window(early):
    """At every level of optimisation: the default is no constant to be folded."""
    model, folder = early
    X = load_trials([folder / "data"]).features(model.info.window_s)
    expected = model.run(X)
    for level in ("ORT_DISABLE_ALL", "ORT_ENABLE_ALL"):
        options = onnxruntime.SessionOptions()
        options.graph_optimization_level = getattr(onnxruntime.GraphOptimizationLevel, level)
        session = onnxruntime.InferenceSession(model.path, options)
        names = [output.name for output in session.get_outputs()]
        seen = dict(zip(names, session.run(None, {"features": X}), strict=True))
        assert {name: values.tolist() for name, values in seen.items()} == {
            name: values.tolist() for name, values in expected.items()
        }
