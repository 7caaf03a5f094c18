"""A model with decision points: p-values, decisions at an error rate, the golden file."""

import json

import numpy as np
import pytest

from edge.classifier import Classifier
from edge.cli import main as edge_classify
from edge.errors import InputError
from edge.events import Decided
from edge.model.model import NO_DECISION_POINT, Model
from edge.recording import load, save
from export.__main__ import main, parse_decision_points
from train.conformal import SequentialClassifier
from train.dataset import load_trials
from train.pipeline import Choice


@pytest.fixture(scope="module")
def touches(make_touch, tmp_path_factory):
    """40 recordings of 4 objects to learn from."""
    folder = tmp_path_factory.mktemp("touches")
    for kind in ("hard", "soft"):
        for seed in range(20):
            save(folder / f"{kind}_{seed:02d}.npz", make_touch(kind=kind, seed=seed))
    return folder


@pytest.fixture(scope="module")
def looked(touches, tmp_path_factory):
    """A folder with their model.onnx and golden.npz, of four decision points."""
    out = tmp_path_factory.mktemp("looked")
    given = [
        "--data",
        str(touches),
        "--out",
        str(out),
        "--jobs",
        "1",
        "--decision-points",
        "0.3,0.6,0.9",
    ]
    assert main(given) == 0
    return out


@pytest.fixture(scope="module")
def model(looked):
    return Model(looked / "model.onnx")


@pytest.fixture(scope="module")
def at_decision_points(touches, model):
    dataset = load_trials([str(touches)], horizon_s=1.2)
    return dataset, np.stack([dataset.features(s) for s in model.decision_points_s])


def test_the_metadata_names_the_looks_and_the_calibration(model):
    assert model.decision_points_s == (0.3, 0.6, 0.9, 1.2)
    assert model.info.folds == (8, 8, 8, 8, 8)
    assert model.info.smallest_error == pytest.approx(1 / 9)
    assert model.info.from_json(model.info.to_json(), "again").to_json() == model.info.to_json()


def test_the_graph_gives_the_estimators_p_values_and_decisions_at_every_look(
    model, at_decision_points
):
    dataset, X = at_decision_points
    y = {task: dataset.labels(task) for task in model.info.tasks}
    choices = {t: Choice(e.scaling, e.components, e.k) for t, e in model.info.tasks.items()}
    fitted = SequentialClassifier(choices, model.decision_points_s).fit(X, y)
    rng = np.random.default_rng(0)
    for decision_point in range(4):
        near = X[decision_point][:20] * (1 + 0.1 * rng.normal(size=(20, 120)))
        queries = np.concatenate([X[decision_point], near, 30.0 * near[:2]])
        answer = model.run(queries, decision_point)
        for task in choices:
            expected = fitted.calibrations_[task].pvalues(decision_point, queries)
            assert (answer[f"{task}_pvalues"] == expected).all()
            _, rows = fitted.decision_points_[decision_point].neighbours(task, queries)
            assert (answer[f"{task}_neighbours"] == rows).all()
            for i in (0, 25, 61):
                decision = model.decide(queries[i], decision_point)[task]
                assert (decision.pvalues == expected[i]).all()


def test_the_full_window_answers_as_a_model_without_looks(
    model, at_decision_points, touches, tmp_path
):
    given = [
        "--data",
        str(touches),
        "--out",
        str(tmp_path),
        "--jobs",
        "1",
        "--decision-points",
        "none",
    ]
    assert main(given) == 0
    plain = Model(tmp_path / "model.onnx")
    assert plain.decision_points_s == (1.2,)
    queries = at_decision_points[1][-1] * 1.03
    expected, answer = plain.run(queries), model.run(queries)
    for name, values in expected.items():
        assert (answer[name] == values).all()
    assert set(answer) - set(expected) == {"category_pvalues", "object_pvalues"}


def test_one_class_and_a_class_of_one_trial_can_be_calibrated(model, at_decision_points, tmp_path):
    from dataclasses import replace

    from edge.model.model import Task
    from export.graph import to_onnx

    _, X = at_decision_points
    y = {"one": np.full(40, "thing"), "rare": np.array(["rare", *["common"] * 39])}
    choices = {"one": Choice("IV", 3, 2), "rare": Choice("IV", 3, 2)}
    fitted = SequentialClassifier(choices, model.decision_points_s).fit(X, y)
    tasks = {
        t: Task(tuple(fitted.decision_points_[0].classes_[t]), 2, 3, "IV", 1.0) for t in choices
    }
    path = tmp_path / "odd.onnx"
    path.write_bytes(to_onnx(fitted, replace(model.info, tasks=tasks)))
    for task, calibration in fitted.calibrations_.items():
        seen = Model(path).run(X[1], 1)[f"{task}_pvalues"]
        assert (seen == calibration.pvalues(1, X[1])).all()
        assert ((seen > 0.0) & (seen <= 1.0)).all()


def test_what_is_not_finite_fits_nothing(model, at_decision_points):
    wrong = at_decision_points[1][1][:2].copy()
    wrong[0, 3] = np.nan
    answer = model.run(wrong, 1)
    assert answer["object_label"][0] == -1
    assert (answer["object_pvalues"][0] == 1 / 9).all()
    assert answer["object_label"][1] >= 0


def replay(model, path, error):
    recording = load(path)
    classifier = Classifier(model, recording.layout, error=error)
    events = [(f.t, e.to_dict()) for f in recording for e in classifier.push(f)]
    return events + [(None, e.to_dict()) for e in classifier.finish()]


def test_a_task_is_decided_at_the_first_look_that_leaves_one_label(model, touches):
    events = replay(model, touches / "soft_03.npz", 0.25)
    by_task = {e["task"]: (t, e) for t, e in events if e["event"] == "decision"}
    t, category = by_task["category"]
    assert category["label"] == "soft-fixed"
    assert category["left"] == ["soft-fixed"]
    assert category["window_s"] == 0.3
    assert t == pytest.approx(0.5)
    assert category["error"] == 0.25
    assert category["confidence"] >= 0.75
    assert category["flags"] == ["as_trained"]


def test_where_several_labels_are_left_at_the_full_window_the_best_is_unsure(model, touches):
    """The two soft objects are alike: only their numbers differ."""
    events = [e for _, e in replay(model, touches / "soft_03.npz", 0.12)]
    thing = next(e for e in events if e.get("task") == "object")
    assert thing["window_s"] == 1.2
    assert thing["flags"] == ["as_trained", "unsure"]
    assert thing["label"] in thing["left"] == ["soft 0", "soft 1"]


def test_each_task_is_decided_once(model, touches):
    for error in (0.12, 0.3, 0.6):
        events = replay(model, touches / "hard_05.npz", error)
        tasks = [e["task"] for _, e in events if e["event"] == "decision"]
        assert sorted(tasks) == ["category", "object"]


def test_without_an_error_rate_the_full_window_decides_alone(model, touches):
    decisions = [e for _, e in replay(model, touches / "soft_03.npz", None) if "task" in e]
    assert [e["window_s"] for e in decisions] == [1.2, 1.2]
    assert all("left" not in e for e in decisions)


def test_a_contact_unlike_all_that_was_trained_is_unknown(model, touches):
    recording = load(touches / "soft_03.npz")
    # Half the skin at once, at a tenth of full scale: no touch was like it.
    frames = np.where(recording.frames.any(axis=(1, 2))[:, None, None], 6500, 0)
    frames = np.broadcast_to(frames, recording.frames.shape).astype(np.uint16).copy()
    frames[:, 8:] = 0
    classifier = Classifier(model, recording.layout, error=0.2, novelty_rate=0.15)
    from dataclasses import replace

    strange = replace(recording, frames=frames)
    events = [e for f in strange for e in classifier.push(f) if isinstance(e, Decided)]
    assert {e.label for e in events} == {"unknown"}
    assert all("unknown" in e.flags for e in events)
    assert all(e.window_s == 0.3 for e in events)


def test_a_stream_that_ends_between_looks_takes_the_best_of_what_is_left(model, make_touch):
    short = make_touch(kind="soft", seconds=0.4, seed=4)
    classifier = Classifier(model, short.layout, error=0.12)
    events = [e for f in short for e in classifier.push(f)] + classifier.finish()
    thing = next(e for e in events if isinstance(e, Decided) and e.task == "object")
    assert thing.flags == ("short", "unsure")
    assert thing.label in thing.remaining


def test_the_golden_file_covers_the_looks(looked, capsys, tmp_path):
    files = ["--model", str(looked / "model.onnx"), "--golden"]
    assert edge_classify(["verify", *files, str(looked / "golden.npz")]) == 0
    checks = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    names = {check["name"]: check["rows"] for check in checks}
    assert names["features at decision points"] == 4
    assert names["object_decision_point_pvalues"] == 4
    assert names["category_pvalues"] == 194
    arrays = dict(np.load(looked / "golden.npz"))
    for key, change in {
        "object_decision_point_pvalues": 0.1,
        "decision_point_vectors": 1e-9,
    }.items():
        wrong = {**arrays, key: arrays[key] + change}
        np.savez(tmp_path / "golden.npz", **wrong)
        assert edge_classify(["verify", *files, str(tmp_path / "golden.npz")]) == 1
    assert "features at decision points differs" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["replay", "run"])
@pytest.mark.parametrize("rate", ["0", "1", "-0.5", "nan"])
def test_an_error_rate_outside_its_range_is_one_sentence(command, rate, looked, touches, capsys):
    source = [str(touches)] if command == "replay" else ["--fake", str(touches / "hard_00.npz")]
    given = [command, "--model", str(looked / "model.onnx"), f"--error={rate}", *source]
    assert edge_classify(given) == 2
    out = capsys.readouterr()
    assert out.err == (f"edge-classify: --error must be above 0 and below 1, not {float(rate):g}\n")
    assert out.out == ""


def test_a_model_without_calibration_is_one_sentence(exported, recordings, capsys):
    model = str(exported / "model.onnx")
    assert edge_classify(["replay", "--model", model, "--error", "0.1", str(recordings)]) == 2
    out = capsys.readouterr()
    assert (
        "has no calibration, so --error cannot be held; export it with --decision-points" in out.err
    )
    assert out.err.count("\n") == 1
    with pytest.raises(InputError, match="no calibration"):
        Classifier(Model(model), error=0.1)


def test_an_error_rate_that_too_few_trials_can_tell_is_remarked_on(looked, touches, capsys):
    given = ["replay", "--model", str(looked / "model.onnx"), "--error", "0.05"]
    assert edge_classify([*given, str(touches / "hard_00.npz")]) == 0
    out = capsys.readouterr()
    assert "calibrated with 40 trials, which resolve error rates down to 0.111" in out.err
    decisions = [json.loads(line) for line in out.out.splitlines() if "decision" in line]
    assert [d["window_s"] for d in decisions] == [1.2, 1.2]
    assert all("unsure" in d["flags"] for d in decisions)


def test_looks_are_read_as_a_range_or_a_list_and_end_with_the_window():
    assert parse_decision_points("0.2:1.2:0.2", 1.2) == (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
    assert parse_decision_points("0.2:1.2:0.2", 0.5) == (0.2, 0.4, 0.5)
    assert parse_decision_points("0.9,0.3", 1.2) == (0.3, 0.9, 1.2)
    assert parse_decision_points("none", 1.2) == ()
    for text in ("", "soon", "0:1:0.1", "0.5:0.2:0.1", "0.1:1:0", "-1,2", "nan"):
        with pytest.raises(InputError, match="--decision-points must be like"):
            parse_decision_points(text, 1.2)


def test_a_look_that_the_model_has_not_is_refused(model):
    with pytest.raises(InputError, match="has the decision points 0 to 3, not 4"):
        model.decide(np.zeros(120), 4)


def test_without_a_look_the_graph_strikes_out_nothing_and_answers_as_at_the_full_window(
    model, at_decision_points
):
    queries = at_decision_points[1][-1][:9] * 1.03
    full = model.run(queries)
    given = {"features": queries, "decision_point": np.array([NO_DECISION_POINT])}
    plain = dict(zip(full, model._session.run(list(full), given), strict=True))
    for name, values in full.items():
        if name.endswith("_pvalues"):
            assert values.shape == plain[name].shape
            assert (plain[name] == 1.0).all()
            assert (values < 1.0).any()
        else:
            assert values.tobytes() == plain[name].tobytes()
    assert all(d.pvalues is None for d in model.decide(queries[0]).values())
