"""The files of a folder: which are trials, their names, and their labels."""

import re
import subprocess

import pytest

from tests.train.importers.test_csv import RATE, imported, put
from train.__main__ import main

TRIAL = "t,p1\n0,1\n0.1,2\n"


def test_labels_that_tell_all_trials_apart_are_said(folder, capsys):
    put(folder, {f"acrylic_{n}_hold.csv": "t,s1,s2\n0,1,2\n1,3,4\n" for n in range(4)})
    imported(folder, "--time-unit", "s")
    output = capsys.readouterr().out
    assert "each trial has a label of its own" in output
    line = re.search(r"\(echo.*", output)[0]
    subprocess.run(["bash", "-c", line], cwd=folder, check=True)
    _, recordings = imported(folder, "--time-unit", "s")
    assert recordings["acrylic_3_hold"].labels == {"object": "acrylic"}


@pytest.mark.parametrize(
    "name",
    [
        "{}/trial_1/x.csv",
        "{}_1.csv",
        "{}/exp3/day_2/x.csv",
        "{}/2024-03-01/x.csv",
    ],
)
def test_a_label_is_no_folder_that_counts_trials(folder, name):
    put(folder, {name.format(label): TRIAL for label in ("cup", "pen")})
    _, recordings = imported(folder)
    labels = [recording.labels["object"] for recording in recordings.values()]
    assert labels == ["cup", "pen"]


def test_numbered_folders_are_labels_where_none_is_above_them(folder, capsys):
    put(folder, {"box_1/a.csv": TRIAL, "box_2/a.csv": TRIAL})
    _, recordings = imported(folder)
    assert recordings["box_2_a"].labels == {"object": "box_2"}
    output = capsys.readouterr().out
    assert 'label: the folder\'s name, such as "box_1"' in output


def test_files_that_are_only_numbered_have_no_label(folder, capsys):
    put(folder, {"001.csv": TRIAL, "002.csv": TRIAL})
    _, recordings = imported(folder)
    assert recordings["001"].labels == {}
    assert "label: none, as the files' names only count" in capsys.readouterr().out


def test_hidden_files_and_other_formats_are_not_read(folder):
    hidden = {"._cup_1.csv": b"\0", ".cache/cup_2.csv": TRIAL}
    foreign = {"cup_3.xlsx": b"PK", "skin.json": "{}"}
    put(folder, {"cup_1.csv": TRIAL} | hidden | foreign)
    status, recordings = imported(folder)
    assert status == 0
    assert list(recordings) == ["cup_1"]


def test_the_columns_are_those_of_most_files(folder, capsys):
    files = {f"cup_{i}.csv": TRIAL for i in range(3)}
    put(folder, {"a_1.csv": TRIAL.replace("p1", "u1")} | files)
    status, recordings = imported(folder)
    assert status == 1
    assert list(recordings) == ["cup_0", "cup_1", "cup_2"]
    assert (
        "a_1.csv: has time in s and 1 taxels ['u1'], and most have time in s"
        in capsys.readouterr().err
    )


def test_of_two_trials_of_one_name_the_first_is_imported(folder, capsys):
    put(folder, {"cup_1.csv": TRIAL, "cup_1.txt": TRIAL, "cup_2.csv": TRIAL})
    status, recordings = imported(folder)
    assert status == 1
    assert list(recordings) == ["cup_1", "cup_2"]
    assert "two trials are named cup_1; rename one" in capsys.readouterr().err


def test_labels_of_no_file_and_files_without_labels_are_named(folder, capsys):
    labels = "trial,object\nr0,box\nR1,cup\n"
    put(folder, {"r0.csv": TRIAL, "r1.csv": TRIAL, "labels.csv": labels})
    status, recordings = imported(folder)
    err = capsys.readouterr().err
    assert status == 1
    assert recordings["r0"].labels == {"object": "box"}
    assert recordings["r1"].labels == {}
    assert "R1 names no file" in err
    assert "has no row for r1" in err


def test_a_row_may_name_the_file_and_leave_it_out(folder):
    labels = "file;object;left_out\nr0.csv;box;\nb/r1.csv;cup;\nr2.csv;cup;yes\n"
    files = dict.fromkeys(("r0.csv", "b/r1.csv", "r2.csv"), TRIAL)
    put(folder, files | {"labels.csv": labels})
    status, recordings = imported(folder)
    assert status == 0
    labels = {name: trial.labels["object"] for name, trial in recordings.items()}
    assert labels == {"r0": "box", "b_r1": "cup"}


def test_a_row_of_a_file_that_is_not_imported_is_no_slip(folder, capsys):
    files = {"r0.csv": TRIAL, "r1.csv": b"\0", "r2.csv": "t,p1\n0,x\n"}
    labels = "trial,object\nr0,box\nr1,cup\nr2,cup\n"
    put(folder, files | {"labels.csv": labels})
    _, recordings = imported(folder)
    assert list(recordings) == ["r0"]
    error = capsys.readouterr().err
    assert "r1.csv: not a table: it is not text" in error
    assert "names no file" not in error
    out = str(folder.parent / "one")
    assert main(["import", "csv", str(folder / "r0.csv"), "--out", out]) == 0


def test_a_label_that_is_a_number_stands_as_it_is(folder):
    table = "trial,object,softness\n1,012,\n2,None,1\n"
    put(folder, {"1.txt": "1 2\n1 3\n", "2.txt": "1 2\n1 3\n", "labels.csv": table})
    _, recordings = imported(folder, *RATE)
    assert recordings["1"].labels == {"object": "012"}
    assert recordings["2"].labels == {"object": "None", "softness": "1"}
