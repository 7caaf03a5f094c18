"""`edge-classify explain`: the nearest trials by name."""

import pytest


def test_a_program_gets_the_trials_by_name(edge, exported, recordings):
    words = (exported / "model.onnx", recordings / "hard_0.npz")
    status, (category, about_object), _ = edge("explain", *words)
    assert status == 0
    assert about_object["task"] == "object"
    assert category["task"] == "category"
    assert category["label"] == "rigid-fixed"
    # The touch itself was trained with.
    assert category["nearest"][0]["trial"] == "hard_0"
    assert category["nearest"][0]["distance"] == pytest.approx(0.0, abs=1e-5)
    assert category["nearest"][0]["label"] == "rigid-fixed"


def test_a_person_gets_lines_that_fit(edge, exported, recordings, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    words = (exported / "model.onnx", recordings / "soft_1.npz")
    status, out, _ = edge("explain", *words, text=True)
    assert status == 0
    assert "category: soft-fixed, by " in out
    assert "  soft_1: soft-fixed\n" in out
    assert max(map(len, out.splitlines()[1:])) <= 80


def test_what_cannot_be_explained_is_one_sentence(exported, quiet, refused):
    err = refused("explain", exported / "model.onnx")
    assert "and the recordings to explain" in err
    err = refused("explain", exported / "model.onnx", quiet)
    assert "quiet.npz: holds no contact; leave it out" in err
