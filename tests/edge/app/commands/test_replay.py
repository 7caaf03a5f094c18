"""`edge-classify replay` and `verify`, as a user runs them."""

import sys

import numpy as np
import pytest

from tests.conftest import decided, ended, python


@pytest.fixture
def replay(exported, edge):
    command = ("replay", "--model", exported / "model.onnx")
    return lambda *arguments: edge(*command, *arguments)


def test_the_summary_counts_what_is_right(replay, recordings):
    _, events, err = replay(recordings, "--summary")
    # Every trial is its own nearest neighbour here, so nothing can be wrong.
    of_category = [e for e in events if e.get("task") == "category"]
    assert all(e["label"] == e["expected"] for e in of_category)
    assert "category: 16 of 16 right, 100.00% (95 % interval 80.6% to 100.0%)" in err
    assert "rigid-fixed            8           ." in err
    assert "16 of 16 recordings match a training trial to the last bit" in err


def test_bad_files_are_named_and_the_others_still_run(replay, recordings, tmp_path):
    good = recordings / "hard_0.npz"
    (tmp_path / "short.npz").write_bytes(good.read_bytes()[:5000])
    frames = np.zeros((1, 3, 3), np.uint16)
    np.savez(tmp_path / "skin.npz", t=np.zeros(1), frames=frames, meta="{}")
    paths = [tmp_path / f"{name}.npz" for name in ("short", "missing", "skin")]
    status, events, err = replay(*paths, good)
    assert status == 2
    assert decided(events, "task") == ["category", "object"]
    short, missing, skin = err.splitlines()
    assert "short.npz: not a readable .npz file" in short
    assert "missing.npz: cannot be read: No such file" in missing
    assert "skin.npz: has no joint angles" in skin


def test_a_recording_without_contact_says_so(replay, quiet):
    status, events, err = replay(quiet, "--summary")
    assert status == 0
    assert [e["event"] for e in events] == ["no_contact"]
    assert "0 of 1 right" in err


def test_a_pipe_that_is_closed_is_quiet(exported, recordings):
    words = (sys.executable, "-m edge replay --model", exported / "model.onnx")
    line = f"{' '.join(map(str, words))} {recordings} | head -1"
    piped = ended("sh", "-c", line)
    assert piped.stdout.count("\n") == 1
    assert piped.stderr == ""


def test_output_without_room_is_one_sentence(exported, recordings):
    options = ("--model", exported / "model.onnx", recordings / "hard_0.npz")
    with open("/dev/full", "w") as full:
        run = python("-m", "edge", "replay", *options, stdout=full)
    assert run.returncode == 2
    assert run.stderr.startswith(
        "edge-classify: standard output cannot be written: No space left"
    )
    assert run.stderr.count("\n") == 1
