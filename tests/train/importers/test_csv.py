"""Tables of values: the same trial in every form, sensors that fall, and what cannot be
used."""

import io
import json

import numpy as np
import pytest
from scipy.io import savemat

from edge.recording import load
from train.__main__ import main
from train.importers.csv import _table

T = np.array([0.0, 0.02, 0.05, 0.06])
FRAMES = np.arange(24).reshape(4, 2, 3)
WIDE = np.column_stack([T, FRAMES.reshape(4, 6)])
ANGLES = np.radians(np.column_stack([90.0 - T, 10.0 * T]))


def text(rows, mark=",", head="") -> str:
    lines = [mark.join(map(str, row)) for row in rows]
    return "\n".join([*([head] if head else []), *lines]) + "\n"


def wide_with_a_header(folder):
    (folder / "cup 3.csv").write_text(text(WIDE, head="time,a,b,c,d,e,f"))


def numbers_alone(folder):
    (folder / "cup_3.txt").write_text(text(WIDE, "  "))
    return ["--time", "1"]


def an_array(folder):
    (folder / "cup").mkdir()
    np.save(folder / "cup" / "3.npy", FRAMES)
    return ["--rate", "50"]


def a_matlab_file(folder):
    savemat(folder / "cup-3.mat", {"t": T, "skin": FRAMES, "by": "somebody"})


def write_frames(folder, times, frames, names="{1:.3f}"):
    """A trial: CSV files that are named by their times, or by their numbers."""
    folder.mkdir(parents=True)
    for i, (t, frame) in enumerate(zip(times, frames, strict=True)):
        np.savetxt(folder / f"{names.format(i, t)}.csv", frame, fmt="%d", delimiter=",")


def a_file_for_each_frame(folder):
    write_frames(folder / "cup-3", 8.0 + T, FRAMES)
    return ["--frames"]


def a_numbered_file_for_each_frame(folder):
    write_frames(folder / "cup" / "3", T, FRAMES, "frame-{0:04}")
    return ["--frames", "--rate", "50"]


def a_long_table_of_values(folder):
    rows = [
        ("3", "cup", t, taxel, count)
        for t, frame in zip(T, FRAMES, strict=True)
        for taxel, count in enumerate(frame.ravel())
    ]
    (folder / "all.csv").write_text(text(rows[::-1], ";", "trial;object;t;taxel;value"))


def a_long_table_of_frames(folder):
    rows = [("3", "cup", *row) for row in WIDE]
    (folder / "all.tsv").write_text(
        text(rows, "\t", "trial\tobject\tseconds\ta\tb\tc\td\te\tf")
    )


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "in").mkdir()
    return tmp_path / "in"


def imported(folder, *words):
    """The exit status, and the recordings by name, of a folder or of the long table in
    it."""
    path = next(folder.glob("all.*"), folder)
    out = folder.parent / "out"
    status = main(["import", "csv", str(path), "--out", str(out), *words])
    return status, {file.stem: load(file) for file in sorted(out.glob("*.npz"))}


@pytest.mark.parametrize(
    "form",
    [
        wide_with_a_header,
        numbers_alone,
        an_array,
        a_matlab_file,
        a_long_table_of_values,
        a_long_table_of_frames,
        a_file_for_each_frame,
        a_numbered_file_for_each_frame,
    ],
    ids=lambda form: form.__name__,
)
def test_the_same_trial_comes_out_of_every_form(form, folder):
    words = form(folder) or []
    status, recordings = imported(folder, "--shape", "2x3", *words)
    assert status == 0
    (trial,) = recordings.values()
    assert (trial.frames == FRAMES).all()
    assert trial.t == pytest.approx(np.arange(4) / 50 if "--rate" in words else T)
    assert trial.labels == {"object": "cup"}


def test_values_that_fall_are_taken_from_the_quietest_start(folder, capsys):
    rest = [240, 250]
    early = [[238, 249], [236, 250], [230, 241]]  # pressed from its first frame on
    quiet = [rest, [241, 249], rest, [233, 250]]
    (folder / "pen_1.txt").write_text(text(early, " "))
    (folder / "pen_2.txt").write_text(text(quiet, " "))
    status, recordings = imported(folder, "--falls", "--rate", "10")
    assert status == 0
    assert recordings["pen_1"].frames[:, 0].tolist() == [[2, 1], [4, 0], [10, 9]]
    assert recordings["pen_2"].frames[:, 0].tolist() == [[0, 0], [0, 1], [0, 0], [7, 0]]
    assert "noise before contact" in capsys.readouterr().out


def test_the_first_frame_of_a_folder_is_the_earliest(folder):
    write_frames(folder / "cup", [10.0, 9.0], FRAMES[:2], "{1:g}")
    _, recordings = imported(folder, "--frames")
    assert (recordings["cup"].frames == FRAMES[1::-1]).all()
    assert recordings["cup"].t.tolist() == [0.0, 1.0]


def test_texts_are_objects_as_numpy_swallows_ctrl_c_in_texts_of_its_own(folder):
    wide_with_a_header(folder)
    (file,) = folder.iterdir()
    assert _table(file).values.dtype == object


def test_trials_may_be_numbered_in_an_array(folder):
    rows = np.array([[0.0], [0.0], [7.0]])
    savemat(
        folder / "all.mat",
        {"trial": rows, "t": np.array([[0.0], [0.1], [0.0]]), "a": rows},
    )
    _, recordings = imported(folder)
    assert {name: len(trial.t) for name, trial in recordings.items()} == {
        "0.0": 2,
        "7.0": 1,
    }


def test_joints_fractions_gaps_and_files_beside(folder):
    rows = [[0.5 * i, "nan", 90, -90] for i in range(3)]
    (folder / "a.csv").write_text(text(rows, head="left,right,q.1,q.2"))
    (folder / "labels.csv").write_text("\ufefftrial,object,who\na,bear,me\n")
    (folder / "skin.json").write_text(
        json.dumps({"rows": 2, "cols": 1, "threshold_counts": 3})
    )
    words = ["--rate", "10", "--joints", "q", "--degrees", "--scale", "10"]
    status, recordings = imported(folder, *words)
    assert status == 0
    trial = recordings["a"]
    assert trial.frames[:, :, 0].tolist() == [[0, 0], [5, 0], [10, 0]]
    assert trial.valid[:, :, 0].tolist() == [[True, False]] * 3
    assert trial.joints == pytest.approx(np.radians([[90, -90]] * 3))
    assert trial.labels == {"object": "bear", "who": "me"}
    assert (trial.layout.threshold_counts, trial.meta["arm"]) == (3, None)


def stored(array) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


EMPTY = "holds no values; leave it out or save it again"
RATE = ("--rate", "1")


@pytest.mark.parametrize(
    ("files", "words", "sentence"),
    [
        (
            {"1.txt": "1 2\n3 4\n"},
            (),
            "1.txt: no column is a time; give --rate HZ or --time COL",
        ),
        (
            {"1.txt": "1 2\n\n3\n"},
            RATE,
            "1.txt: row 2 has 1 value, and the first row 2",
        ),
        (
            {"1.csv": "a,b\n1,2\n1,2,3\n"},
            RATE,
            "1.csv: row 3 has 3 values, and the first row 2",
        ),
        ({"1.txt": ""}, RATE, f"1.txt: {EMPTY}"),
        ({"1.txt": "\n \n"}, RATE, f"1.txt: {EMPTY}"),
        ({"1.csv": "time,a,b\n"}, RATE, f"1.csv: {EMPTY}"),
        ({"1.npy": stored(np.zeros((0, 3)))}, RATE, f"1.npy: {EMPTY}"),
        ({"1.npy": stored(np.array(["a"]))}, RATE, f"1.npy: {EMPTY}"),
        ({"1.npy": b"hello"}, RATE, "1.npy: not a table: "),
        ({"1.mat": b"hello" * 40}, RATE, "1.mat: not a table: "),
        (
            {"1.txt": b"\xff\xfe1"},
            RATE,
            "1.txt: not a table: it is not UTF-8 text; save it",
        ),
        ({"1.csv": "a,b\n1,2\n1,x\n"}, RATE, "1.csv: 'x' in column b is no number"),
        (
            {"1.txt": "1 2\n"},
            (*RATE, "--taxels", "3"),
            "has no column 3; it has ['1', '2']",
        ),
        ({"1.txt": "1 -2\n"}, RATE, "-2 to 1 are no counts"),
        (
            {"1.txt": "1 2.5\n"},
            RATE,
            "1 to 2.5 are no counts (whole numbers from 0 to 65535)",
        ),
        (
            {"1.txt": "1 2\n"},
            (*RATE, "--shape", "2x2"),
            "2 columns are not 2 x 2 taxels",
        ),
        (
            {"1.txt": "1 2\n"},
            (*RATE, "--shape", "2x-1"),
            "--shape must be ROWSxCOLS, such as 16x",
        ),
        ({"1.txt": "1 2\n", "2.txt": "1 2 3\n"}, RATE, "2.txt: has 3 taxels, and "),
        ({}, (), "in: holds no file .csv"),
        (
            {"a.csv": "1 2\n"},
            ("--frames",),
            "in: holds no folder of frames; give a folder of",
        ),
        (
            {"a/0.csv": "1 2\n", "a/b.csv": "1 2\n"},
            ("--frames",),
            "a: not a folder of files that ",
        ),
        (
            {"a/0.csv": "1 2\n", "a/1.csv": "1\n2\n"},
            ("--frames",),
            "1.csv: is 2 x 1 taxels, and ",
        ),
        ({"a/0.csv": "1 0.5\n"}, ("--frames",), "a: 0.5 to 1 are no counts"),
        (
            {"1.txt": "1 2\n", "skin.json": "[1]"},
            RATE,
            "skin.json: the file must be a table",
        ),
        (
            {"1.txt": "1 2\n", "skin.json": '{"rows": "x"}'},
            RATE,
            "skin.json: rows must be a whole",
        ),
        (
            {"1.txt": "1 2\n", "labels.csv": "trial,who\n2,me\n"},
            RATE,
            "labels.csv: needs a column trial with names such as ['1']",
        ),
        (
            {"1.txt": "1 2\n", "labels.csv": "object,who\n1,me\n"},
            RATE,
            "labels.csv: needs a col",
        ),
        ({"1.txt": "1 2\n", "labels.csv": ""}, RATE, f"labels.csv: {EMPTY}"),
        ({"1.txt": "1 2\n", "1.csv": "1 2\n"}, RATE, "in: two trials are named 1"),
        (
            {"all.csv": "trial,a\n../1,2\n"},
            RATE,
            "all.csv: the trial '../1' needs a name ",
        ),
    ],
)
def test_what_cannot_be_used_is_one_sentence(files, words, sentence, folder, refusal):
    for name, content in files.items():
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(
            content if isinstance(content, bytes) else content.encode()
        )
    path = next(folder.glob("all.*"), folder)
    assert sentence in refusal(
        "import", "csv", path, "--out", folder.parent / "out", *words
    )
