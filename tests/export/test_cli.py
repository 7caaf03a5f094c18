"""`make export` as a user meets it."""

import io
import os
import shutil
from contextlib import redirect_stderr
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import Mock

import numpy as np
import pytest
from joblib import delayed

from edge import demo
from edge.decide.model import Model
from edge.decide.statistics import wilson
from edge.record.recording import Recording
from edge.record.saving import save
from export.__main__ import main
from export.cli import held_out_text, parse_decision_points
from tests.conftest import PAPER, export
from train.threads import in_processes, on_cluster


def test_a_folder_that_cannot_be_written_is_named_before_any_work(tmp_path, capsys):
    (tmp_path / "file").touch()
    out = tmp_path / "file"
    assert main(["--data", str(tmp_path / "missing"), "--out", str(out)]) == 2
    sentence = f"edge-classify export: {out}: cannot be written: it is no folder\n"
    assert capsys.readouterr().err == sentence
    words = ["--data", "missing", "--out", str(tmp_path), "--c", str(out)]
    assert main(words) == 2
    assert capsys.readouterr().err == sentence


@pytest.mark.parametrize(
    ("option", "value", "sentence"),
    [
        ("--dead", "3,x", "must be ROW,COL, such as 3,5"),
        ("--dead", "1,2,3", "must be ROW,COL, such as 3,5"),
        ("-k", "0", "must be a whole number from 1"),
        ("--window", "0", "must be a number from 0.01 to 60"),
        ("--threshold", "-3", "must be a whole number from 0 to 65534"),
        ("--c-error", "nan", "must be a number from 1e-06 to 0.999999"),
    ],
)
def test_a_value_outside_its_range_is_refused(option, value, sentence, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(["--data", "x", option, value])
    assert sentence in capsys.readouterr().err


@pytest.fixture(scope="module")
def printed(recordings, tmp_path_factory):
    """What a quick export prints, and the description of its model."""
    folder = tmp_path_factory.mktemp("quick")
    err = io.StringIO()
    with redirect_stderr(err):
        export(folder, "--data", recordings, "--quick")
    lines = err.getvalue().splitlines()
    info = Model(folder / "model.onnx").info
    return SimpleNamespace(lines=lines, info=info)


@pytest.mark.parametrize(
    ("task", "right"), [("object", None), ("category", 6.4)], ids=["trials", "objects"]
)
def test_it_prints_the_accuracy_of_each_task(printed, task, right):
    (line,) = (line for line in printed.lines if line.startswith(f"{task}:"))
    assert f"{printed.info.tasks[task].accuracy:.1%}" in line
    assert "of 16 trials are right (95 % interval " in line
    if right is not None:
        low, high = wilson(right, right)
        assert f"interval {100 * low:.0f} to {100 * high:.0f})" in line


@pytest.mark.slow
def test_the_same_data_gives_the_same_files(recordings, exported, tmp_path):
    export(tmp_path, "--data", recordings, *PAPER, "--jobs", 2)
    for name in ("model.onnx", "golden.npz"):
        assert (tmp_path / name).read_bytes() == (exported / name).read_bytes()


def test_fixed_values_and_some_tasks(recordings, tmp_path):
    fixed = "--scaling II --components 3 --k 2 --window 0.8 --threshold 120 --release 2"
    words = f"{fixed} --tasks object --name pads".split()
    export(tmp_path, "--data", recordings, *words, *PAPER)
    info = Model(tmp_path / "model.onnx").info
    (task,) = info.tasks.values()
    of_task = (task.scaling, task.components, task.k, task.projection, task.features)
    assert of_task == ("II", 3, 2, "pca", info.features)
    assert (info.name, info.window_s) == ("pads", 0.8)
    assert (info.layout.threshold_counts, info.layout.release_s) == (120, 2.0)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["-k", "99"], "k must be 1 to 14, the trials that remain of 16"),
        (["--threshold", "200", "--onset", "100"], "onset_counts 100 is below"),
        (["--tasks", "colour"], "label 'colour'; all have category, object"),
        (["--data", "."], ".: no .npz recording in this folder"),
        (
            ["--decision-points", "0.3,x"],
            "--decision-points must be like 0.2:1.2:0.1 or",
        ),
        (["--decision-points", "0:0.6:0.3"], "(seconds above 0) or none"),
        (["--decision-points", "0.9:0.6:0.3"], "(seconds above 0) or none"),
        (
            ["--front", "fast"],
            "build/tradeoff/front.json: cannot be read: No such file",
        ),
    ],
)
def test_options_that_make_no_sense_are_one_sentence(
    options, word, recordings, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "out"
    command = ["--data", str(recordings), "--out", str(out), "--jobs", "1"]
    assert main([*command, *(() if "--front" in options else PAPER), *options]) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("edge-classify export: ")
    assert word in last
    assert not any(out.iterdir())


@pytest.mark.parametrize(
    ("text", "window_s", "points"),
    [
        ("none", 1.2, ()),
        ("0.9,0.3", 1.2, (0.3, 0.9, 1.2)),
        ("0.2:2:0.3", 0.8, (0.2, 0.5, 0.8)),
    ],
)
def test_the_window_is_the_last_decision_point(text, window_s, points):
    assert parse_decision_points(text, window_s) == points


def test_trials_that_span_few_components_get_a_warning(recordings, tmp_path, capsys):
    few = [
        recordings / f"{kind}_{i}.npz" for kind in ("hard", "soft") for i in range(3)
    ]
    export(tmp_path, "--data", *few, "--components", 20, *PAPER)
    err = capsys.readouterr().err
    assert "span 5 components, 15 fewer than asked for" in err


@pytest.fixture
def held_out(recordings, tmp_path):
    """The recordings in another folder."""
    return shutil.copytree(recordings, tmp_path / "held-out")


def test_what_is_held_out_must_not_be_fitted(recordings, capsys):
    file = min(recordings.glob("*.npz"))
    assert main(["--data", str(recordings), "--test", str(file)]) == 2
    assert f"{file}: is in --data and in --test" in capsys.readouterr().err


def test_a_former_model_in_the_same_place_is_compared_as_it_was(
    exported, recordings, held_out, tmp_path, capsys
):
    path = shutil.copy(exported / "model.onnx", tmp_path)
    words = "--features max_force --projection pca --decision-points none".split()
    words += ["--test", held_out, "--compare", path]
    export(tmp_path, "--data", recordings, *words)
    err = capsys.readouterr().err
    assert "16 of 16 recordings match a training trial to the last bit" in err
    comparison = err.splitlines()[-4:-2]
    assert "0 gained, 0 lost" not in comparison[-1]
    files = sorted(held_out.glob("*.npz"))
    text = held_out_text(Model(path), Model(exported / "model.onnx"), files)
    assert text.splitlines()[-4:-2] == comparison


@pytest.fixture
def unfitted(monkeypatch):
    monkeypatch.setattr("export.cli.fit", Mock(side_effect=AssertionError("fitted")))


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--test", "missing"], "missing: cannot be read: No such file or directory"),
        (["--test", "loop"], "loop: cannot be read: Too many levels of symbolic links"),
        (["--test", "x.npz", "--compare", "old.onnx"], "old.onnx: no such model"),
        (["--compare", "old.onnx"], "--compare needs --test"),
        (["--flash", "512"], "--c-error, --flash and --skin need --c"),
    ],
)
def test_held_out_recordings_and_a_former_model_are_checked_before_any_work(
    words, sentence, tmp_path, capsys, monkeypatch, unfitted
):
    monkeypatch.chdir(tmp_path)
    Path("loop").symlink_to("loop")
    assert main(["--data", "data", "--out", str(tmp_path), *words]) == 2
    assert sentence in capsys.readouterr().err


def test_a_former_model_that_needs_joints_is_refused_before_any_work(
    recordings, tmp_path, capsys, unfitted
):
    touch = tmp_path / "touch.npz"
    still = np.zeros((2, 16, 24), np.uint16)
    save(touch, Recording(np.array([0.0, 0.1]), still), lasting=False)
    words = ["--test", str(touch), "--compare", str(demo.MODEL)]
    assert main(["--data", str(recordings), "--out", str(tmp_path), *words]) == 2
    assert f"{touch}: has no joint angles" in capsys.readouterr().err


@pytest.mark.slow
def test_the_workers_of_a_cluster_make_the_same_model(recordings, tmp_path):
    dask = pytest.importorskip("distributed", reason="the group cluster is missing")
    words = ["--data", str(recordings), "--features", "paper", "--quick", "--jobs", "1"]
    assert main([*words, "--out", str(tmp_path / "alone")]) == 0
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with dask.LocalCluster(**options) as cluster:
        address = cluster.scheduler_address
        out = str(tmp_path / "shared")
        assert main([*words, "--out", out, "--cluster", address]) == 0
        with on_cluster(address):
            (worker,) = in_processes(1, [delayed(os.getpid)()])
    assert worker != os.getpid()
    alone, shared = (tmp_path / name / "model.onnx" for name in ("alone", "shared"))
    assert shared.read_bytes() == alone.read_bytes()
