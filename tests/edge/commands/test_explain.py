"""`edge-classify explain`: the nearest trials by name, the features' pulls, the least changes."""

import json

import pytest

from edge.cli import main


def test_a_program_gets_the_trials_by_name_and_the_parts(exported, recordings, capsys):
    words = ["explain", str(exported / "model.onnx"), str(recordings / "hard_0.npz")]
    assert main(words) == 0
    lines = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [line["task"] for line in lines] == ["category", "object"]
    category = lines[0]
    assert category["label"] == "rigid-fixed"
    # The touch itself was trained with.
    assert category["nearest"][0]["trial"] == "hard_0"
    assert category["nearest"][0]["distance"] == pytest.approx(0.0, abs=1e-5)
    assert category["rival"]["trial"].startswith("soft_")
    assert category["rival"]["label"] == "soft-fixed"
    assert category["changes"][0]["label"] == "soft-fixed"


def test_a_person_gets_lines_that_fit(exported, recordings, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["explain", str(exported / "model.onnx"), str(recordings / "soft_1.npz")]) == 0
    out = capsys.readouterr().out
    assert "category: soft-fixed, by " in out
    assert "soft_1, soft-fixed\n" in out
    assert ", rigid-fixed, the nearest of another label\n" in out
    assert "  rather than rigid-fixed: " in out
    assert "  rigid-fixed, were " in out
    assert max(map(len, out.splitlines()[1:])) <= 80


def test_a_recording_without_contact_is_one_sentence(exported, recordings, capsys, tmp_path):
    from edge.recording import Recording, load, save

    touch = load(recordings / "hard_0.npz")
    save(tmp_path / "a.npz", Recording(touch.t, 0 * touch.frames, touch.joints, meta=touch.meta))
    assert main(["explain", str(exported / "model.onnx"), str(tmp_path / "a.npz")]) == 2
    assert capsys.readouterr().err.endswith("a.npz: holds no contact\n")
