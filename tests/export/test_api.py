"""Fit and export from Python, and the sentences that go with a model."""

import hashlib
import shutil
from dataclasses import replace

import numpy as np
import pytest

import export
import train
from edge.classifier import Classifier
from edge.model.model import Model
from edge.model.verify import verify
from edge.recording import load, save
from export.api import (
    LEAK,
    coarseness,
    measure,
    names,
    report,
    told_by_order,
    told_by_posture,
    warnings,
)
from train.pipeline import ContactClassifier


@pytest.fixture(scope="module")
def fitted(recordings):
    return train.fit(str(recordings), features=["paper"], projection="pca", jobs=1)


def test_a_fitted_model_is_saved_with_its_golden_outputs(fitted, tmp_path):
    path = tmp_path / "model.onnx"
    assert export.save(path, fitted) == path.stat().st_size
    model = Model(path)
    assert all(check.passed for check in verify(model, tmp_path / "golden.npz"))
    assert model.info.tasks["object"].projection == "pca"
    assert model.info.tasks["object"].left_out == "trial"
    assert model.info.tasks["object"].accuracy == fitted.chosen["object"].accuracy.accuracy


def test_a_model_has_a_name_a_version_and_the_names_of_its_trials(fitted, recordings, tmp_path):
    path = tmp_path / "model.onnx"
    export.save(path, fitted, "pads")
    model = Model(path)
    assert model.info.trials == tuple(f"{kind}_{i}" for kind in ("hard", "soft") for i in range(8))
    assert model.named == f"pads {hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
    decided = list(Classifier(model).classify(load(recordings / "soft_3.npz")))[1]
    assert decided.nearest[0] == "soft_3"
    assert decided.to_dict()["model"] == model.named
    export.save(path, fitted)
    assert Model(path).info.name == recordings.name


def test_trials_of_one_recording_are_numbered_and_too_many_names_are_left_out(
    fitted, tmp_path, monkeypatch
):
    trials = fitted.dataset.trials
    twice = replace(fitted.dataset, trials=(*trials[:2], trials[1]))
    assert names(twice)[1] == ("hard_0", "hard_1 1", "hard_1 2")
    monkeypatch.setattr("export.api.MOST_NAMES", 16 * len("hard_0") - 1)
    export.save(tmp_path / "model.onnx", fitted)
    info = Model(tmp_path / "model.onnx").info
    assert (info.trials, info.trial(3)) == ((), "trial 3")


def test_tasks_of_different_features_share_one_vector(recordings, tmp_path):
    fitted = train.fit(str(recordings), features=["paper", "contact"], jobs=1, k=1)
    own = {
        "category": replace(fitted.chosen["category"].choice, features=("log_max_force@5",)),
        "object": fitted.chosen["object"].choice,
    }
    names, widths = fitted.dataset.names, fitted.dataset.widths(fitted.samples)
    classifier = train.fitting.ContactClassifier(own, names, widths)
    y = {task: fitted.dataset.labels(task) for task in own}
    export.save(
        tmp_path / "model.onnx",
        replace(fitted, classifier=classifier.fit(fitted.X, y), sequential=None),
    )
    model = Model(tmp_path / "model.onnx")
    seen = model.run(1.01 * fitted.X)
    for task in own:
        _, rows = classifier.neighbours(task, 1.01 * fitted.X)
        assert (seen[f"{task}_neighbours"] == rows).all()


def test_a_row_a_candidate_says_what_it_gives_and_costs(fitted):
    prices = measure(fitted)
    assert all(us > 0 and kilobytes > 1 for us, kilobytes in prices)
    lines = report(fitted, prices).splitlines()
    assert lines[0].endswith("kB")
    assert lines[1].startswith("paper  ")


def test_what_flatters_or_is_left_out_is_said(recordings, make_touch, tmp_path):
    save(tmp_path / "still.npz", make_touch(seconds=0.0))
    save(tmp_path / "odd.npz", make_touch(labels={"category": "soft-fixed"}))
    paths = [str(recordings), str(tmp_path)]
    fitted = train.fit(paths, features=["paper"], projection="pca", window_s=9.0, jobs=1)
    text = report(fitted)
    assert "warning: without a contact above 150 counts, and counted as wrong: " in text
    assert "python -m train thresholds" in text
    assert "recordings are left out for lack of a label for object: " in text
    assert "the window of 9 s is longer than any recording goes on after its onset" in text


def test_recordings_of_no_contact_are_decided_as_such(recordings, make_touch, tmp_path):
    still = make_touch(seconds=0.0, labels={"category": "none", "object": "hard 0"})
    save(tmp_path / "still.npz", still)
    paths = [str(recordings), str(tmp_path)]
    fitted = train.fit(paths, features=["paper"], projection="pca", jobs=1)
    assert not any("no contact" in line for line in warnings(fitted))
    export.save(tmp_path / "model.onnx", fitted)
    (said,) = Classifier(Model(tmp_path / "model.onnx")).classify(still)
    assert (said.task, said.label) == ("category", "none")


def test_joint_angles_that_tell_the_label_before_the_touch_are_named(recordings, tmp_path):
    """The arm stood elsewhere for each object: its angles tell all without a touch."""
    objects = sorted({load(path).labels["object"] for path in recordings.glob("*.npz")})
    for path in recordings.glob("*.npz"):
        recording = load(path)
        place = np.full_like(recording.joints, 0.3 * objects.index(recording.labels["object"]))
        save(tmp_path / path.name, replace(recording, joints=place))
    fitted = train.fit(str(tmp_path), features=["posture"], jobs=1, k=1, quick=True)
    assert told_by_posture(fitted.dataset, "object") == 1.0
    (said,) = [line for line in warnings(fitted) if line.startswith("warning: object")]
    assert "at onset alone give 100.0% of the labels" in said


def test_joint_angles_that_tell_nothing_are_no_leak(recordings, tmp_path):
    """Every recording begins in a pose that one of another object has too, and no other."""
    for i, path in enumerate(sorted(recordings.glob("*.npz"))):
        recording = load(path)
        save(tmp_path / path.name, replace(recording, joints=0.0 * recording.joints + i % 8))
    fitted = train.fit(str(tmp_path), features=["posture"], jobs=1, k=1, quick=True)
    assert told_by_posture(fitted.dataset, "object") == 0.0 < LEAK
    assert not any("warning: object: the joint angles" in line for line in warnings(fitted))


def test_equal_trials_of_different_labels_are_counted(recordings, tmp_path):
    """One touch stored under three names, twice with its own label and once with another."""
    shutil.copytree(recordings, tmp_path, dirs_exist_ok=True)
    touch = load(recordings / "soft_7.npz")
    save(tmp_path / "again.npz", touch)
    other = {**touch.labels, "object": "another"}
    save(tmp_path / "other.npz", replace(touch, meta={**touch.meta, "labels": other}))
    fitted = train.fit(str(tmp_path), features=["paper"], projection="pca", jobs=1, k=1)
    said = [line for line in warnings(fitted) if "have the same coordinates" in line]
    assert [line.split(" have")[0] for line in said] == ["warning: object: 3 trials"]


def test_a_trial_so_far_outside_that_the_others_hardly_differ_is_named(recordings):
    """A skin that was stored with a scale of its own: one trial of newtons a million times too
    many leaves a few steps for all others."""
    fixed = {"features": ["paper"], "projection": "pca", "scaling": "none", "jobs": 1, "k": 1}
    fitted = train.fit(str(recordings), components=5, **fixed)
    assert not any("steps" in line for line in warnings(fitted))
    outlier = fitted.X.copy()
    outlier[7] *= 3e6
    classifier = ContactClassifier(fitted.classifier.choices, fitted.dataset.names)
    classifier.fit(outlier, {task: fitted.dataset.labels(task) for task in fitted.chosen})
    said = [line for line in warnings(replace(fitted, classifier=classifier)) if "steps" in line]
    assert len(said) == len(fitted.chosen)
    assert f"since {fitted.dataset.trials[7].path} lies far outside all others" in said[0]


@pytest.mark.parametrize(
    ("rows", "steps", "farthest"),
    [
        ([[0.0], [0.0], [3.0], [10.0]], 3.0, 3),  # equal rows are skipped: 3, 3, 3, 7
        ([[2.0], [2.0]], np.inf, 0),
        ([[0.0, 0.0], [6.0, 8.0]], 10.0, 1),
    ],
)
def test_coarseness_is_the_median_gap_of_neighbours_in_units(rows, steps, farthest):
    assert coarseness(0.5 * np.array(rows), 0.5) == (steps, farthest)


def test_rows_that_are_equal_but_for_rounding_are_not_equal():
    rows = np.array([[0.0], [1.0], [0.0], [1.0 + 1e-15], [2.0], [2.0]])
    assert told_by_order(rows, np.array([0, 1, 1, 0, 1, 1])) == 2
