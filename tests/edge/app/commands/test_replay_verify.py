"""`edge-classify replay` and `verify`, as a user runs them."""

import sys

import numpy as np
import pytest

from edge.decide.summary import Summary, compared
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


@pytest.fixture
def verify(exported, edge):
    command = ("verify", "--model", exported / "model.onnx", "--golden")
    return lambda golden: edge(*command, golden)


def test_the_golden_file_is_met(verify, exported):
    status, checks, err = verify(exported / "golden.npz")
    assert status == 0
    names = ["series length", "series counts", "onset", "features"]
    for task in ("category", "object"):
        for key in ("label", "neighbours", "scores", "distances"):
            names.append(f"{task}_{key}")
    assert {c["name"] for c in checks} == {*names, "out_of_range"}
    assert all(c["passed"] for c in checks)
    assert "all 13 results agree with the golden file" in err


@pytest.fixture
def arrays(exported):
    """Those of the golden file."""
    return dict(np.load(exported / "golden.npz"))


@pytest.fixture
def verify_changed(verify, arrays, tmp_path):
    """Verify against the arrays as they are by then."""

    def run():
        np.savez(tmp_path / "golden.npz", **arrays)
        return verify(tmp_path / "golden.npz")

    return run


@pytest.mark.parametrize(
    ("key", "row", "change"),
    [
        ("object_label", 5, 1),
        ("object_distances", 30, 1e-9),
        ("series_counts", 11, 1),
        ("onset_s", 1, 1e-6),
    ],
)
def test_a_difference_names_its_row(verify_changed, arrays, key, row, change):
    name = {"series_counts": "series counts", "onset_s": "onset"}.get(key, key)
    arrays[key][row] += np.array(change).astype(arrays[key].dtype)
    status, checks, err = verify_changed()
    (failed,) = (check for check in checks if not check["passed"])
    assert status == 1
    assert failed["name"] == name
    assert failed["row"] == row
    assert f"results that differ from the golden file: {name}" in err


@pytest.mark.parametrize("key", ["vectors", "meta", "series_counts"])
def test_a_golden_file_that_lacks_a_key_is_one_sentence(verify_changed, arrays, key):
    del arrays[key]
    status, _, err = verify_changed()
    assert status == 2
    assert err.count("\n") == 1
    assert "golden.npz" in err


def test_vectors_of_another_model_are_refused(verify_changed, arrays):
    arrays["vectors"] = arrays["vectors"][:, :50]
    assert "50), but" in verify_changed()[2]


def test_frames_with_other_joints_are_refused_by_the_name_of_the_file(
    verify_changed, arrays
):
    arrays["joints"] = arrays["joints"][:, :3]
    assert "golden.npz: trial 0: has 3 joint angles" in verify_changed()[2]


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


def summed(*pairs):
    """A summary of one task: labels, and what was decided."""
    summary = Summary({"object": None})
    for number, (label, answer) in enumerate(pairs):
        event = {"event": "decision", "task": "object", "label": answer, "flags": []}
        summary.add({"object": label}, [event], str(number))
    return summary


def test_a_label_cannot_send_escape_sequences_to_the_terminal():
    text = summed(("\u202ebox\x9b", "\x1b]0;a\x07")).text()
    assert all(line.isprintable() for line in text.splitlines())
    assert "\\x1b]0;a\\x07" in text


def test_a_comparison_counts_what_is_gained_and_lost():
    first = summed(*[("a", "a")] * 4, *[("b", "a")] * 6)
    second = summed(*[("b", "a")] * 2, *[("a", "a")] * 8)
    text = compared("A", first, "B", second)
    assert "object: 6 gained, 2 lost of 10: +40.0 points" in text
    assert "favours" not in text
