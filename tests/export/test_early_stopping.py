"""The graph's distances to each label, and the board's stopping, against the
estimators."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from onnxruntime import GraphOptimizationLevel

import train
from edge.decide.classifier import Classifier
from edge.decide.early import fastest, stopping_rules
from edge.decide.events import Decided
from edge.decide.model import Model
from edge.decide.verify import first_series
from edge.errors import InputError
from edge.features.vector import FEATURES
from edge.record.saving import save
from export.api import save as save_model
from tests.checks.hard_cases.models import session
from tests.conftest import PAPER, export, save_touches
from tests.sequential import fitted_model
from train.data.dataset import load_trials
from train.model.pipeline import Choice
from train.model.stopping import EarlySettings

LABELS = {"t": np.array(["a", "b", "c"] * 15), "u": np.array(["x", "y", "y"] * 15)}
"""Labels of 45 trials for two tasks."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of recordings, data/, and of the model that was fitted on them, out/."""
    folder = tmp_path_factory.mktemp("early")
    data = save_touches(folder / "data", 15)
    points = ("--decision-points", "0.3,0.6,1.2", "--scaling", "IV")
    export(folder / "out", "--data", data, *PAPER, *points)
    return folder


@pytest.fixture(scope="module")
def early(folder):
    """A model with decision points."""
    return Model(folder / "out" / "model.onnx")


@pytest.fixture
def error(early):
    """The smallest error that is certified for category."""
    return early.info.stopping["category"].rules[0].error


def decided(model, recording, error):
    """{task: the decision} of a recording."""
    events = Classifier(model, recording.layout, error=error).classify(recording)
    return {event.task: event for event in events if isinstance(event, Decided)}


@pytest.fixture(scope="module")
def with_early_settings(early, tmp_path_factory):
    """Vectors, and a model whose tasks take other features before 1.2 s."""
    rng = np.random.default_rng(3)
    X = rng.normal(size=(3, 45, early.info.width))
    choices = {
        "t": Choice("none", 4, 3, features=FEATURES[:2]),
        "u": Choice("none", 3, 3, "lda", features=FEATURES),
    }
    area = FEATURES[1:2]
    at_first = {
        "t": Choice("IV", 6, 3, features=area),
        "u": Choice("IV", 2, 3, features=area),
    }
    settings = EarlySettings(at_first, [at_first] * 10)
    path = tmp_path_factory.mktemp("early") / "model.onnx"
    return X, fitted_model(path, early.info, choices, X, LABELS, settings)[1]


def test_a_far_feature_matters_only_where_a_decision_point_takes_it(
    with_early_settings,
):
    X, model = with_early_settings
    far = X[0, :1].copy()
    far[0, 0] = 1e6
    outside = [model.run(far, point)["out_of_range"].tolist() for point in range(3)]
    assert outside == [[0.0], [0.0], [1.0]]


def test_a_stream_that_ends_before_any_rule_is_sure_is_decided_at_its_end(
    early, make_touch, error
):
    events = decided(early, make_touch(kind="soft", seed=50, seconds=0.25), error)
    assert list(events) == list(early.info.tasks)
    assert all("short" in event.flags for event in events.values())


def test_a_task_that_is_never_sure_waits_for_the_last_decision_point_of_its_rule(
    early,
    make_touch,
    monkeypatch,
    error,
):
    rule = replace(stopping_rules(early, error)["category"], confidence=2.0, last=1)
    waits = replace(early.info.stopping["category"], rules=(rule,))
    monkeypatch.setitem(early.info.stopping, "category", waits)
    category = decided(early, make_touch(seed=50), error)["category"]
    assert category.window_s == early.decision_points_s[1]
    assert category.stopped_by == "window"
    assert category.error == error


@pytest.fixture
def uncertified(early, monkeypatch):
    """The model, with no certified rule for object."""
    stopping = early.info.stopping["object"]
    never = replace(stopping, rules=(replace(stopping.rules[0], error=1.0),))
    monkeypatch.setitem(early.info.stopping, "object", never)
    return early


@pytest.mark.parametrize("seed", range(50, 56))
def test_a_task_without_a_certified_rule_is_decided_as_without_an_error_rate(
    uncertified,
    make_touch,
    error,
    seed,
):
    touch = make_touch(kind=("hard", "soft")[seed % 2], seed=seed)
    limited = decided(uncertified, touch, error)["object"]
    plain = decided(uncertified, touch, None)["object"]
    assert limited.label == plain.label
    assert limited.confidence == plain.confidence
    assert limited.window_s == plain.window_s
    assert {*limited.flags} == {*plain.flags, "uncertified"}


@pytest.fixture
def hasty(early, monkeypatch):
    """The model that stops at the first decision point, and its smallest error."""
    smallest = []
    for task, stopping in early.info.stopping.items():
        rule = replace(stopping.rules[0], confidence=0.0)
        hurried = replace(stopping, rules=(rule,))
        monkeypatch.setitem(early.info.stopping, task, hurried)
        smallest.append(rule.error)
    return early, max(smallest)


@pytest.fixture
def strange(make_touch):
    """A touch unlike all others."""
    ordinary = make_touch(kind="hard", seed=50)
    return replace(ordinary, frames=np.minimum(ordinary.frames.astype(int) * 40, 65535))


def test_a_touch_unlike_all_others_waits_and_is_flagged_as_unusual(
    hasty, make_touch, strange
):
    model, error = hasty
    ordinary = make_touch(kind="hard", seed=50)
    for touch, rate, stop in (
        (ordinary, error, (0.3, "confidence", False)),
        (strange, error, (1.2, "confidence", True)),
        (strange, None, (1.2, None, True)),
    ):
        for event in decided(model, touch, rate).values():
            flagged = "unusual" in event.flags
            assert (event.window_s, event.stopped_by, flagged) == stop


@pytest.mark.parametrize("early_ones", [True, False])
def test_an_unknown_thing_has_no_name_but_a_kind_at_once(
    hasty, make_touch, monkeypatch, early_ones
):
    model, error = hasty
    stopping = model.info.stopping["object"]
    nowhere = replace(stopping.remoteness, limits=(0.0, 0.0, 0.0))
    unmet = replace(stopping, remoteness=nowhere)
    monkeypatch.setitem(model.info.stopping, "object", unmet)
    touch = make_touch(kind="hard", seed=50)
    events = decided(model, touch, error if early_ones else None)
    assert events["object"].label is None
    assert events["object"].confidence == 0.0
    assert events["object"].flags == ("unknown",)
    assert events["object"].window_s == (0.3 if early_ones else 1.2)
    assert events["category"].label == "rigid-fixed"
    assert "unknown" not in events["category"].flags


def test_an_error_that_no_task_certifies_is_refused_with_what_would_do(early):
    with pytest.raises(
        InputError, match="cannot be certified; category: the smallest error that"
    ):
        Classifier(early, error=0.001)


@pytest.mark.parametrize("level", ["ORT_DISABLE_ALL", "ORT_ENABLE_ALL"])
def test_a_stranger_with_onnxruntime_alone_is_answered_at_the_full_window(
    early, folder, level
):
    """The default is no constant to be folded."""
    X = load_trials([folder / "data"]).features(early.info.window_s)
    data = Path(early.path).read_bytes()
    runtime = session(data, getattr(GraphOptimizationLevel, level))
    names = [output.name for output in runtime.get_outputs()]
    outputs = zip(names, runtime.run(names, {"features": X}), strict=True)
    expected = {name: values.tolist() for name, values in early.run(X).items()}
    assert {name: values.tolist() for name, values in outputs} == expected


def pressed(make_touch, seeds):
    """Touches of an object; their category is of its softness and of how hard they are
    pressed."""
    for kind, press, seed in itertools.product(("hard", "soft"), (4, 5), seeds):
        labels = {"softness": kind, "mobility": f"by {press}"}
        labels |= {"category": f"{kind}-by {press}", "object": f"{kind} {seed % 2}"}
        touch = make_touch(kind=kind, seed=seed, labels=labels)
        frames = (touch.frames * (press / 4)).astype(np.uint16)
        yield replace(touch, frames=frames)


@pytest.fixture(scope="module")
def agreeing(make_touch, tmp_path_factory):
    folder = tmp_path_factory.mktemp("agreement")
    for i, recording in enumerate(pressed(make_touch, range(8))):
        save(folder / f"{i:02d}.npz", recording)
    points = {"features": ["paper"], "decision_points_s": (0.3, 0.6, 1.2)}
    fitted = train.fit(folder, **points, quick=True, jobs=1)
    save_model(folder / "model.onnx", fitted)
    return fitted, Model(folder / "model.onnx")


@pytest.mark.parametrize("rate", [None, 0.3, 0.5, 0.9])
def test_no_decision_contradicts_another(agreeing, make_touch, rate):
    _, model = agreeing
    assert model.info.products.keys() == {"category"}
    for recording in pressed(make_touch, range(50, 55)):
        events = decided(model, recording, rate)
        factors = [events[task] for task in ("softness", "mobility")]
        category = events["category"]
        assert category.label == "-".join(factor.label for factor in factors)
        assert category.decision.label == category.label
        assert category.window_s == max(factor.window_s for factor in factors)


def test_the_board_decides_as_the_trials_that_certified_its_rules_were(
    agreeing, make_touch
):
    fitted, model = agreeing
    recordings = list(pressed(make_touch, range(60, 64)))
    vectors = [
        [model.info.vector(first_series(r, model)[1], s) for r in recordings]
        for s in model.decision_points_s
    ]
    truth = {
        task: np.array([recording.labels[task] for recording in recordings])
        for task in model.info.tasks
    }
    _, _, series = fitted.sequential.judged(np.array(vectors), truth)
    error = max(of.rules[0].error for of in model.info.stopping.values())
    events = [decided(model, recording, error) for recording in recordings]
    for task, time_series in series.items():
        at, wrong = time_series.under(fastest(model.info.stopping[task], error))
        answers = zip(events, at, wrong, truth[task], strict=True)
        for event, point, is_wrong, label in answers:
            assert event[task].window_s == model.decision_points_s[point]
            assert (event[task].label != label) == is_wrong
