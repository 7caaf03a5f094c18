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


def test_a_far_feature_matters_only_where_a_decision_point_takes_it(early, tmp_path):
    X = np.random.default_rng(3).normal(size=(3, 45, early.info.width))
    choices = {"t": Choice("none", 4, 3, features=FEATURES)}
    at_first = {"t": Choice("IV", 6, 3, features=FEATURES[1:2])}
    _, model = fitted_model(
        tmp_path / "model.onnx",
        early.info,
        choices,
        X,
        {"t": np.array(["a", "b", "c"] * 15)},
        EarlySettings(at_first, [at_first] * 10),
    )
    far = X[0, :1].copy()
    far[0, 0] = 1e6
    outside = [model.run(far, point)["out_of_range"].tolist() for point in range(3)]
    assert outside == [[0.0], [0.0], [1.0]]


@pytest.fixture
def change(early, monkeypatch):
    """Changes what the model says of a task's stopping."""

    def change(task, **changes):
        changed = replace(early.info.stopping[task], **changes)
        monkeypatch.setitem(early.info.stopping, task, changed)

    return change


def test_a_stream_that_ends_before_any_rule_is_sure_is_decided_at_its_end(
    early, make_touch, error
):
    events = decided(early, make_touch(kind="soft", seed=50, seconds=0.25), error)
    assert list(events) == list(early.info.tasks)
    assert all("short" in event.flags for event in events.values())


def test_a_task_that_is_never_sure_waits_for_the_last_decision_point_of_its_rule(
    early, make_touch, change, error
):
    rule = replace(stopping_rules(early, error)["category"], confidence=2.0, last=1)
    change("category", rules=(rule,))
    category = decided(early, make_touch(seed=50), error)["category"]
    assert category.window_s == early.decision_points_s[1]
    assert category.stopped_by == "window"
    assert category.error == error


@pytest.mark.parametrize("seed", range(50, 56))
def test_a_task_without_a_certified_rule_is_decided_as_without_an_error_rate(
    early, make_touch, change, error, seed
):
    change("object", rules=())
    touch = make_touch(kind=("hard", "soft")[seed % 2], seed=seed)
    limited, plain = (decided(early, touch, rate)["object"] for rate in (error, None))
    assert {*limited.flags} == {*plain.flags, "uncertified"}
    for name in ("label", "confidence", "window_s"):
        assert getattr(limited, name) == getattr(plain, name)


@pytest.fixture
def hasty(early, change):
    """The model that stops at the first decision point, and its smallest error."""
    rules = {task: of.rules[0] for task, of in early.info.stopping.items()}
    for task, rule in rules.items():
        change(task, rules=(replace(rule, confidence=0.0),))
    return early, max(rule.error for rule in rules.values())


def test_a_touch_unlike_all_others_waits_and_is_flagged_as_unusual(hasty, make_touch):
    model, error = hasty
    ordinary = make_touch(kind="hard", seed=50)
    counts = np.minimum(ordinary.frames.astype(int) * 40, 65535)
    strange = replace(ordinary, frames=counts)
    for touch, rate, stop in (
        (ordinary, error, (0.3, "confidence", False)),
        (strange, error, (1.2, "confidence", True)),
        (strange, None, (1.2, None, True)),
    ):
        for event in decided(model, touch, rate).values():
            flagged = "unusual" in event.flags
            assert (event.window_s, event.stopped_by, flagged) == stop


@pytest.mark.parametrize("window_s", [0.3, 1.2])
def test_an_unknown_thing_has_no_name_but_a_kind_at_once(
    hasty, make_touch, change, window_s
):
    model, error = hasty
    known_distance = model.info.stopping["object"].known_distance
    change("object", known_distance=replace(known_distance, limits=(0.0, 0.0, 0.0)))
    touch = make_touch(kind="hard", seed=50)
    events = decided(model, touch, error if window_s < 1.2 else None)
    name = events["object"]
    kind = events["category"]
    assert (name.label, name.confidence, name.flags) == (None, 0.0, ("unknown",))
    assert name.window_s == window_s
    assert kind.label == "rigid-fixed"
    assert "unknown" not in kind.flags


def test_an_error_that_no_task_certifies_is_refused_with_what_would_do(early):
    with pytest.raises(InputError, match="cannot be certified; category: the smallest"):
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
    assert model.info.joint_tasks.keys() == {"category"}
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
