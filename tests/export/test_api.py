"""Fit and export from Python."""

import hashlib
from dataclasses import replace

import pytest

import export
import train
from edge.decide.classifier import Classifier
from edge.decide.model import Model
from edge.decide.verify import verify
from edge.errors import InputError
from edge.record.recording import load
from edge.record.saving import save
from export import api, c_code
from train.notes import warnings
from train.report.summary import names


def test_a_fitted_model_is_saved_with_its_golden_outputs(fitted, tmp_path):
    path = tmp_path / "model.onnx"
    assert export.save(path, fitted) == path.stat().st_size
    model = Model(path)
    assert all(check.passed for check in verify(model, tmp_path / "golden.npz"))
    task = model.info.tasks["object"]
    assert task.projection == "pca"
    assert task.left_out == "trial"
    assert task.accuracy == fitted.chosen["object"].accuracy.accuracy


def test_a_model_that_cannot_be_read_or_be_written_in_c_leaves_the_former_one(
    fitted, tmp_path, monkeypatch
):
    path = tmp_path / "model.onnx"
    path.write_bytes(b"former")
    with pytest.raises(InputError, match=r"model.onnx: takes 33 kB of flash in C"):
        export.save(path, fitted, None, lambda m: c_code.export(m, tmp_path, None, 1))
    monkeypatch.setattr(api, "to_onnx", lambda *words: b"no model")
    with pytest.raises(InputError, match="not an ONNX model"):
        export.save(path, fitted)
    assert path.read_bytes() == b"former"


def test_a_model_has_a_name_a_version_and_the_names_of_its_trials(
    fitted,
    recordings,
    tmp_path,
):
    path = tmp_path / "model.onnx"
    export.save(path, fitted, "pads")
    model = Model(path)
    assert model.info.trials == tuple(
        f"{kind}_{i}" for kind in ("hard", "soft") for i in range(8)
    )
    assert model.named == f"pads {hashlib.sha256(path.read_bytes()).hexdigest()[:8]}"
    decided = list(Classifier(model).classify(load(recordings / "soft_3.npz")))[1]
    assert decided.nearest[0] == "soft_3"
    assert decided.to_dict()["model"] == model.named
    export.save(path, fitted)
    assert Model(path).info.name == recordings.name


def test_trials_of_one_recording_are_numbered_and_too_many_names_are_left_out(
    fitted,
    tmp_path,
    monkeypatch,
):
    trials = fitted.dataset.trials
    twice = replace(fitted.dataset, trials=(*trials[:2], trials[1]))
    assert names(twice)[1] == ("hard_0", "hard_1 1", "hard_1 2")
    no_text = replace(trials[0], path=trials[0].path.with_name("c\udcff.npz"))
    assert names(replace(twice, trials=(no_text, *trials[1:])))[1][0] == r"c\udcff"
    monkeypatch.setattr("export.api.MOST_NAMES", 16 * len("hard_0") - 1)
    export.save(tmp_path / "model.onnx", fitted)
    info = Model(tmp_path / "model.onnx").info
    assert info.trials == ()
    assert info.trial(3) == "trial 3"


def test_recordings_of_no_contact_are_decided_as_such(recordings, make_touch, tmp_path):
    still = make_touch(seconds=0.0, labels={"category": "none", "object": "hard 0"})
    save(tmp_path / "still.npz", still)
    paths = [str(recordings), str(tmp_path)]
    fitted = train.fit(paths, features=["paper"], projection="pca", jobs=1)
    assert not any("no contact" in line for line in warnings(fitted))
    export.save(tmp_path / "model.onnx", fitted)
    (decision,) = Classifier(Model(tmp_path / "model.onnx")).classify(still)
    assert decision.task == "category"
    assert decision.label == "none"
