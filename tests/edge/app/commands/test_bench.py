"""`edge-classify bench`: a board's figures in one file, written whole."""

import hashlib
import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from edge.app.cli import main
from edge.app.commands import bench
from edge.app.commands.bench import summary, touch
from edge.errors import InputError
from edge.touch.track import first_contact


@pytest.fixture(scope="module")
def board(exported, tmp_path_factory):
    out = tmp_path_factory.mktemp("bench") / "board.json"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bench, "ROUNDS", 20)
        options = ["--model", str(exported / "model.onnx"), "--out", str(out)]
        assert main(["bench", *options]) == 0
    return json.loads(out.read_text())


def test_a_folder_that_cannot_be_written_is_named_before_any_work(
    exported, tmp_path, capsys, monkeypatch
):
    monkeypatch.delattr(bench, "measure")
    (tmp_path / "file").touch()
    out = tmp_path / "file" / "board.json"
    options = ["--model", str(exported / "model.onnx"), "--out", str(out)]
    assert main(["bench", *options]) == 2
    assert f"{out.parent}: cannot be written" in capsys.readouterr().err


def test_every_stage_has_a_median_and_a_99th_percentile(board):
    stages = ["track", "features", "decision", "frame", "last"]
    assert list(board["stages"]) == stages
    for stage in board["stages"].values():
        assert 0.0 < stage["median_us"] <= stage["p99_us"]
        assert stage["n"] >= 4


def test_the_model_is_named_by_its_digest(board, model):
    data = Path(model.path).read_bytes()
    assert board["model"]["sha256"] == hashlib.sha256(data).hexdigest()
    assert board["model"]["data_digest"] == model.info.data_digest


def test_percentiles_are_by_nearest_rank():
    expected = {"median_us": 100.5, "p99_us": 198.0, "n": 200}
    assert summary([float(i) for i in range(1, 201)]) == expected


def test_the_touch_is_a_contact_that_grows_over_the_whole_window(model):
    info = model.info
    frames = touch(model, info.window_s)
    onset, series = first_contact(frames, info.tracker(info.layout))
    assert onset == 0.0
    assert series.t[-1] == pytest.approx(info.window_s)
    assert series.area[-1] > series.area[0] > 1
    assert series.peak[-1] > series.peak[0]


def test_a_model_of_a_skin_that_no_touch_reaches_is_refused(model):
    deaf = replace(model.info.layout, threshold_counts=65535, onset_counts=65535)
    info = replace(model.info, layout=deaf)
    with pytest.raises(InputError, match="begins above 65535 counts, which no taxel"):
        bench.time_stages(SimpleNamespace(info=info, path="model.onnx"), 4)
