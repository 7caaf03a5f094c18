"""The labels of trials: a table, a column of texts, names and folders."""

import pytest

from tests.train.importers.test_csv import imported, put
from train.__main__ import main

TRIAL = "t,p1\n0,1\n0.1,2\n"


def labels_in(folder, *words):
    """The objects of a folder's recordings, in the order of their names."""
    _, recordings = imported(folder, *words)
    return [recording.labels.get("object") for recording in recordings.values()]


@pytest.mark.parametrize(
    "name",
    [
        "{}/trial_1/x.csv",
        "{}_1.csv",
        "{}/exp3/day_2/x.csv",
        "{}/2024-03-01/x.csv",
        "{}.1a3b.csv",
        "{}.9k2.ingestion-6bd.csv",
        "{} (2).csv",
    ],
)
def test_the_label_is_the_name_without_what_counts(folder, name):
    put(folder, {name.format(label): TRIAL for label in ("cup", "pen")})
    assert labels_in(folder) == ["cup", "pen"]


def test_numbered_folders_are_labels_where_none_is_above_them(folder):
    put(folder, {"box_1/a.csv": TRIAL, "box_2/a.csv": TRIAL})
    assert labels_in(folder) == ["box_1", "box_2"]


def test_files_that_are_only_numbered_have_no_label(folder, capsys):
    put(folder, {"001.csv": TRIAL, "002.csv": TRIAL})
    assert labels_in(folder) == [None, None]
    assert "label: none" in capsys.readouterr().out


def test_a_label_for_each_trial_is_a_warning_with_what_gives_others(folder, capsys):
    put(folder, {f"wood_{n}_hold.csv": TRIAL for n in range(4)})
    assert len(set(labels_in(folder))) == 4
    output = capsys.readouterr().out
    assert "a label of its own, by the file's name" in output
    assert "--label 1" in output
    assert labels_in(folder, "--label", "1") == ["wood"] * 4
    assert labels_in(folder, "--label", "3") == ["hold"] * 4


def rows_of(*labels, name="label"):
    """A trial with a column of labels."""
    rows = [f"{0.01 * i:.2f},{i},{label}" for i, label in enumerate(labels)]
    return "\n".join([f"t,p1,{name}", *rows])


@pytest.mark.parametrize("name", ["label", "Class", "object"])
def test_a_column_of_labels_is_taken_before_the_names(folder, name):
    put(folder, {f"walk_{n}.csv": rows_of(n, n, name=name) for n in ("mud", "ice")})
    assert labels_in(folder) == ["ice", "mud"]


def test_a_column_of_texts_that_several_trials_share_is_a_task(folder, capsys):
    files = {
        f"walk_{n}.csv": rows_of(text, text, name="surface")
        for n, text in enumerate(("mud", "mud", "ice"))
    }
    put(folder, files)
    _, recordings = imported(folder)
    surfaces = [recording.labels["surface"] for recording in recordings.values()]
    assert surfaces == ["mud", "mud", "ice"]
    assert "ignored" not in capsys.readouterr().out


@pytest.mark.parametrize("word", ["9", "colour"])
def test_a_label_that_is_not_there_is_refused(folder, refused, word):
    put(folder, {"cup_1.csv": TRIAL})
    assert f"--label {word}" in refused("csv", folder, "--label", word)


def test_a_table_of_labels_wins(folder, capsys):
    labels = "file,object,hand,left_out\nr0.csv,box,left,\nR1,cup,,\nr2,cup,,x\n"
    put(folder, {f"r{n}.csv": TRIAL for n in range(3)} | {"labels.csv": labels})
    status, recordings = imported(folder)
    err = capsys.readouterr().err
    assert status == 1
    assert recordings["r0"].labels == {"object": "box", "hand": "left"}
    assert recordings["r1"].labels == {}
    assert "r2" not in recordings
    assert "R1 names no file" in err
    assert "no row for r1" in err


def test_a_row_of_a_file_that_is_not_imported_is_no_slip(folder, capsys):
    files = {"r0.csv": TRIAL, "r1.csv": b"\0", "r2.csv": "t,p1\n0,x\n1,y\n"}
    labels = "trial,object\nr0,box\nr1,cup\nr2,cup\n"
    put(folder, files | {"labels.csv": labels})
    _, recordings = imported(folder)
    assert list(recordings) == ["r0"]
    error = capsys.readouterr().err
    assert "r1.csv" in error
    assert "names no file" not in error
    out = str(folder.parent / "one")
    assert main(["import", "csv", str(folder / "r0.csv"), "--out", out]) == 0
