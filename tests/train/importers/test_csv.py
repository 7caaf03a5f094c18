"""Tables of values: the same trial in every form, sensors that fall, and what cannot be used."""

import json

import numpy as np
import pytest
from scipy.io import savemat

from edge.recording import load
from train.__main__ import main

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


def a_long_table_of_values(folder):
    rows = [
        ("3", "cup", t, taxel, count)
        for t, frame in zip(T, FRAMES, strict=True)
        for taxel, count in enumerate(frame.ravel())
    ]
    (folder / "all.csv").write_text(text(rows[::-1], ";", "trial;object;t;taxel;value"))


def a_long_table_of_frames(folder):
    rows = [("3", "cup", *row) for row in WIDE]
    (folder / "all.tsv").write_text(text(rows, "\t", "trial\tobject\tseconds\ta\tb\tc\td\te\tf"))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "in").mkdir()
    return tmp_path / "in"


def imported(folder, *words):
    """The exit status, and the recordings by name, of a folder or of the long table in it."""
    path = next(folder.glob("all.*"), folder)
    out = folder.parent / "out"
    status = main(["import", "csv", str(path), "--out", str(out), *words])
    return status, {file.stem: load(file) for file in sorted(out.glob("*.npz"))}


@pytest.mark.parametrize(
    "form",
    [
        wide_with_a_header, numbers_alone, an_array, a_matlab_file, a_long_table_of_values,
        a_long_table_of_frames,
    ],
    ids=lambda form: form.__name__,
)  # fmt: skip
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


def test_joints_fractions_gaps_and_files_beside(folder):
    rows = [[0.5 * i, "nan", 90, -90] for i in range(3)]
    (folder / "a.csv").write_text(text(rows, head="left,right,q.1,q.2"))
    (folder / "labels.csv").write_text("trial,object,who\na,bear,me\n")
    (folder / "skin.json").write_text(json.dumps({"rows": 2, "cols": 1, "threshold_counts": 3}))
    words = ["--rate", "10", "--joints", "q", "--degrees", "--scale", "10"]
    status, recordings = imported(folder, *words)
    assert status == 0
    trial = recordings["a"]
    assert trial.frames[:, :, 0].tolist() == [[0, 0], [5, 0], [10, 0]]
    assert trial.valid[:, :, 0].tolist() == [[True, False]] * 3
    assert trial.joints == pytest.approx(np.radians([[90, -90]] * 3))
    assert trial.labels == {"object": "bear", "who": "me"}
    assert (trial.layout.threshold_counts, trial.meta["arm"]) == (3, None)


@pytest.mark.parametrize(
    ("files", "words", "sentence"),
    [
        (["1 2\n3 4\n"], [], "no column is a time; give --rate HZ or --time COL"),
        (["1 2\n3\n"], ["--rate", "1"], "not a table: "),
        (["a,b\n1,2\n1,x\n"], ["--rate", "1"], "not a table of numbers: could not convert"),
        (["1 2\n"], ["--rate", "1", "--taxels", "3"], "has no column 3; it has ['1', '2']"),
        (["1 -2\n"], ["--rate", "1"], "-2 to 1 are no counts"),
        (["1 2.5\n"], ["--rate", "1"], "1 to 2.5 are no counts (whole numbers from 0 to 65535)"),
        (["1 2\n"], ["--rate", "1", "--shape", "2x2"], "2 columns are not 2 x 2 taxels"),
        (["1 2\n"], ["--rate", "1", "--shape", "big"], "--shape big: not ROWSxCOLS"),
        ([""], ["--rate", "1"], "not a table: "),
        (["1 2\n", "1 2 3\n"], ["--rate", "1", "--falls"], "1.txt: has 3 taxels, and "),
        ([], [], "holds no file .csv"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(files, words, sentence, folder, capsys):
    for i, content in enumerate(files):
        (folder / f"{i}.txt").write_text(content)
    assert imported(folder, *words)[0] == 2
    said = capsys.readouterr().err.strip().splitlines()[-1]
    assert sentence in said
    assert (".txt: " in said) != ("big" in words or not files)
