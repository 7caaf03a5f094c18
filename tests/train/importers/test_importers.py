"""The real grasps as recordings, number by number."""

import numpy as np
import pytest

from edge.errors import InputError
from edge.recording import load
from train.__main__ import main
from train.importers import names, sdh2


@pytest.fixture(scope="module")
def archive(real):
    return real / "sdh2_grasps_856.npz"


def test_every_grasp_is_one_recording_with_its_own_frames_and_times(archive):
    raw = np.load(archive)
    trials = list(sdh2.trials(archive))
    assert len(trials) == 856
    assert len({name for name, _ in trials}) == 856
    assert len({r.labels["object"] for _, r in trials}) == 36
    for i in (0, 400, 855):
        a, b = raw["start"][i : i + 2]
        _, recording = trials[i]
        assert (recording.frames[:, :, :6] == raw["frames"][a:b, 0]).all()
        assert (recording.frames[:, :, 7:] == raw["frames"][a:b, 1]).all()
        assert (recording.t * 1000).round().astype(int).tolist() == raw["t_ms"][a:b].tolist()
        assert recording.valid.sum() == 2 * 13 * 6
        assert not recording.valid[:, 6].any()
        assert recording.labels == {"object": str(raw["label"][i])}
        assert recording.layout.force_unit == "count"
        assert recording.layout.pitch_m == 0.0034


def test_the_command_writes_a_folder(archive, tmp_path, monkeypatch, capsys):
    few = list(sdh2.trials(archive))[:3]
    monkeypatch.setattr(sdh2, "trials", lambda path, arm: iter(few))
    assert main(["import", "sdh2", str(archive), "--out", str(tmp_path / "out")]) == 0
    written = sorted((tmp_path / "out").iterdir())
    assert [p.name for p in written] == [f"000{i}_aerosol_can.npz" for i in range(3)]
    assert (load(written[2]).frames == few[2][1].frames).all()
    assert "3 recordings" in capsys.readouterr().out


def good() -> dict[str, np.ndarray]:
    return {
        "frames": np.zeros((5, 2, 13, 6), np.uint16),
        "t_ms": np.arange(5, dtype=np.int32),
        "start": np.array([0, 3, 5]),
        "label": np.array(["a", "b"]),
        "fname": np.array(["a", "b"]),
    }


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"label": None}, "has no label"),
        ({"frames": np.zeros((5, 13, 6), np.uint16)}, "not uint16"),
        ({"start": np.array([0, 3])}, "does not divide"),
        ({"label": np.array(["a"])}, "differ in number"),
        ({"t_ms": np.zeros(3, np.int32)}, "differ in number"),
    ],
)
def test_another_archive_is_refused(change, word, tmp_path, capsys):
    arrays = {k: v for k, v in {**good(), **change}.items() if v is not None}
    np.savez(tmp_path / "x.npz", **arrays)
    with pytest.raises(InputError, match=word):
        list(sdh2.trials(tmp_path / "x.npz"))
    assert main(["import", "sdh2", str(tmp_path / "x.npz"), "--out", str(tmp_path)]) == 2
    assert "x.npz" in capsys.readouterr().err


def test_formats_are_found_by_their_file():
    assert "sdh2" in names()
