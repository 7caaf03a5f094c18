"""`make export` as a user meets it."""

import json

import numpy as np
import pytest

from edge.model.model import Model
from export.__main__ import main


def test_the_report_says_what_was_fitted(recordings, tmp_path, capsys):
    assert main(["--data", str(recordings), "--out", str(tmp_path), "--jobs", "1"]) == 0
    out = capsys.readouterr()
    table = [line.split() for line in out.err.splitlines() if line.startswith(("cat", "obj"))]
    assert [row[:3] for row in table] == [["category", "2", "16"], ["object", "4", "16"]]
    assert all(row[-1].endswith("%") for row in table)
    assert "max_force in newton, contact_area in taxel, contact_motion in metre" in out.err
    assert "motion in the world's frame" in out.err
    assert "reading: 100%" in out.err
    assert out.out.splitlines()[1].endswith("golden.npz")


def test_the_same_data_gives_the_same_files(recordings, exported, tmp_path):
    assert main(["--data", str(recordings), "--out", str(tmp_path), "--jobs", "2"]) == 0
    for name in ("model.onnx", "golden.npz"):
        assert (tmp_path / name).read_bytes() == (exported / name).read_bytes()


def test_golden_holds_raw_frames_and_hard_vectors(exported):
    golden = np.load(exported / "golden.npz")
    assert golden["frames"].dtype == np.uint16
    assert len(golden["start"]) == len(golden["onset_s"]) + 1 == 17
    assert (golden["object_label"][-2:] == -1).all()
    assert (golden["object_distances"][:16, 0] == 0.0).all()  # the trials are training rows
    bounds = json.loads(str(golden["meta"]))["bounds"]
    assert set(bounds) == {"scores", "distances", "features", "time_s"}


def test_fixed_values_and_some_tasks(recordings, tmp_path):
    fixed = ["--scaling", "II", "--components", "3", "--k", "2", "--window", "0.8"]
    command = ["--data", str(recordings), "--out", str(tmp_path), "--tasks", "object", *fixed]
    assert main([*command, "--threshold", "120"]) == 0
    info = Model(tmp_path / "model.onnx").info
    assert list(info.tasks) == ["object"]
    task = info.tasks["object"]
    assert (task.scaling, task.components, task.k) == ("II", 3, 2)
    assert (info.window_s, info.layout.threshold_counts) == (0.8, 120)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--components", "0"], "--components must be at least 1"),
        (["-k", "0"], "--k must be at least 1"),
        (["-k", "99"], "k must be"),
        (["--window", "0"], "--window must be above 0"),
        (["--threshold", "-3"], "--threshold must be 0 to"),
        (["--threshold", "200", "--onset", "100"], "onset_counts 100 is below"),
        (["--tasks", "colour"], "label 'colour'; all have category, object"),
    ],
)
def test_options_that_make_no_sense_are_one_sentence(options, word, recordings, tmp_path, capsys):
    out = tmp_path / "out"
    assert main(["--data", str(recordings), "--out", str(out), "--jobs", "1", *options]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("export: ")
    assert word in last
    assert not out.exists()


def test_a_folder_without_recordings_is_named(tmp_path, capsys):
    assert main(["--data", str(tmp_path), "--out", str(tmp_path / "out")]) == 2
    assert f"{tmp_path}: no .npz recording" in capsys.readouterr().err


def test_trials_that_span_few_components_get_a_warning(recordings, tmp_path, capsys):
    few = [str(recordings / f"{kind}_{i}.npz") for kind in ("hard", "soft") for i in range(3)]
    command = ["--data", *few, "--out", str(tmp_path), "--components", "20", "--jobs", "1"]
    assert main(command) == 0
    err = capsys.readouterr().err
    assert "span 5 components, 15 fewer than asked for" in err
