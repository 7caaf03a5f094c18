"""Tables of values: the same trial in every form, sensors that fall, and what cannot be
used."""

import io
import os

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from edge.record.recording import load
from tests.conftest import python
from train.__main__ import main
from train.importers.csv import PANDAS

T = np.array([0.0, 0.02, 0.05, 0.06])
FRAMES = np.arange(24).reshape(4, 2, 3)
WIDE = np.column_stack([T, FRAMES.reshape(4, 6)])
ANGLES = np.radians(np.column_stack([90.0 - T, 10.0 * T]))


def text(rows, mark=",", head="") -> str:
    lines = [mark.join(map(str, row)) for row in rows]
    return "\n".join([*([head] if head else []), *lines]) + "\n"


def numbers_alone(folder):
    (folder / "cup 3.txt").write_text(text(WIDE, "  "))
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


def put(folder, files):
    """Write files by their names; the folder, or the long table in it."""
    for name, content in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        data = content if isinstance(content, bytes) else content.encode()
        (folder / name).write_bytes(data)
    return next(folder.glob("all.*"), folder)


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
        numbers_alone,
        an_array,
        a_matlab_file,
        a_long_table_of_values,
        a_file_for_each_frame,
        a_numbered_file_for_each_frame,
    ],
)
def test_the_same_trial_comes_out_of_every_form(form, folder):
    words = form(folder) or []
    status, recordings = imported(folder, "--shape", "2x3", *words)
    assert status == 0
    (trial,) = recordings.values()
    assert (trial.frames == FRAMES).all()
    assert trial.t == pytest.approx(np.arange(4) / 50 if "--rate" in words else T)
    assert trial.labels == {"object": "cup"}


def test_the_lines_of_pandas_make_a_recording(folder, refused):
    put(folder, {"cup_1.csv": "t,thumb,index\n0,1,2\n0.1,3,4\n"})
    refused("csv", folder)
    program = PANDAS.partition("\n")[2].replace('"s1", "s2"', '"thumb", "index"')
    python("-c", program, cwd=folder)
    assert load(folder / "cup_1.npz").frames.tolist() == [[[1, 2]], [[3, 4]]]


def test_a_file_whose_columns_are_not_those_of_most_is_left_out(folder, capsys):
    put(folder, {"1.txt": "1 2\n", "2.txt": "1 2 3\n", "3.txt": "1 2\n"})
    status, recordings = imported(folder, *RATE)
    assert status == 1
    assert list(recordings) == ["1", "3"]
    assert "2.txt" in capsys.readouterr().err


def test_the_first_frame_of_a_folder_is_the_earliest(folder):
    write_frames(folder / "cup", [10.0, 9.0], FRAMES[:2], "{1:g}")
    _, recordings = imported(folder, "--frames")
    assert (recordings["cup"].frames == FRAMES[1::-1]).all()
    assert recordings["cup"].t.tolist() == [0.0, 1.0]


def test_trials_may_be_numbered_in_an_array(folder):
    rows = np.array([[0.0], [0.0], [7.0]])
    savemat(
        folder / "all.mat",
        {"trial": rows, "t": np.array([[0.0], [0.1], [0.0]]), "a": rows},
    )
    _, recordings = imported(folder, "--taxels", "a")
    assert {name: len(trial.t) for name, trial in recordings.items()} == {
        "0.0": 2,
        "7.0": 1,
    }


def table(folder, rows, *words):
    """The frames of a table of commas, flat, and its joint angles."""
    put(folder, {"cup_1.csv": rows})
    _, recordings = imported(folder, *words)
    (trial,) = recordings.values()
    return trial.frames.reshape(len(trial.t), -1).tolist(), trial.joints


def test_names_in_the_comment_stand_above_texts_too(folder):
    """As `rostopic echo -p` writes them."""
    head = "%time,field.header.frame_id,field.data0,field.data1\n"
    rows = f"{head}1700000000000000000,pad,3,4\n1700000000010000000,pad,5,6\n"
    assert table(folder, rows)[0] == [[3, 4], [5, 6]]


def test_columns_of_one_name_are_taken_as_pandas_tells_them_apart(folder):
    rows = "time_s,sensor,sensor.1,sensor.2\n0.0,1,2,3\n0.1,4,5,6\n"
    assert table(folder, rows)[0] == [[1, 2, 3], [4, 5, 6]]


def test_joint_angles_in_rows_of_their_own_are_interpolated(folder, capsys):
    rows = "time_s,s1,s2,q\n0.0,,,0.0\n0.1,1,2,\n0.2,,,0.2\n0.9,3,4,\n"
    frames, joints = table(folder, rows, "--taxels", "s1,s2", "--joints", "q")
    assert frames == [[1, 2], [3, 4]]
    np.testing.assert_allclose(joints, [[0.1], [np.nan]])
    assert "lacks joint angles for 1 of 2 frames" in capsys.readouterr().out


def test_joints_fractions_gaps_and_files_beside(folder):
    rows = [[0.5 * i, "nan", 90, -90] for i in range(3)]
    files = {
        "a.csv": text(rows, head="left,right,q.1,q.2"),
        "labels.csv": "\ufefftrial,object,who\na,bear,me\n",
        "skin.json": '{"rows": 2, "cols": 1, "threshold_counts": 3}',
    }
    put(folder, files)
    words = ["--rate", "10", "--joints", "q", "--degrees", "--scale", "10"]
    words += ["--taxels", "left,right"]
    status, recordings = imported(folder, *words)
    assert status == 0
    trial = recordings["a"]
    assert trial.frames[:, :, 0].tolist() == [[0, 0], [5, 0], [10, 0]]
    assert trial.valid[:, :, 0].tolist() == [[True, False]] * 3
    assert trial.joints == pytest.approx(np.radians([[90, -90]] * 3))
    assert trial.labels == {"object": "bear", "who": "me"}
    assert trial.layout.threshold_counts == 3
    assert trial.meta["arm"] is None


def stored(array) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


RATE = ("--rate", "1")


@pytest.mark.parametrize(
    ("files", "words", "sentence"),
    [
        (
            {"1.npy": stored(np.zeros((0, 3)))},
            RATE,
            "1.npy: holds no values; leave it out or save it again",
        ),
        (
            {"1.txt": "1 2\n"},
            (*RATE, "--shape", "2x2"),
            "2 values a frame are no 2 x 2 taxels; give --shape",
        ),
        (
            {"all.csv": "trial,t,p1\na,0,1\na,1,2\n"},
            ("--time", "1"),
            "all.csv: trial a: column trial holds no values of a frame",
        ),
        ({}, (), "in: holds no file .csv"),
        (
            {"a/0.csv": "1 2\n", "a/b.csv": "1 2\n"},
            ("--frames",),
            "a: not a folder of files that ",
        ),
        (
            {"a/0.csv": "1 2\n", "a/1.csv": "1\n2\n"},
            ("--frames",),
            "1.csv: is (2, 1) taxels, and ",
        ),
        (
            {"a/0.npy": stored(np.array(["x"]))},
            ("--frames",),
            "0.npy: not a frame: could not convert string to float",
        ),
        (
            {"1.txt": "1 2\n", "labels.csv": "trial,who\n2,me\n"},
            RATE,
            "labels.csv: needs a column file with names such as ['1']",
        ),
        (
            {"1.txt": "1 2\n", "labels.csv": "trial,object\n1,box\n1,cup\n"},
            RATE,
            "labels.csv, line 3: 1 has line 2 too; remove one of them",
        ),
        (
            {"all.csv": "trial,p1\n../1,2\n"},
            RATE,
            "all.csv: the trial '../1' needs a name ",
        ),
    ],
)
def test_what_cannot_be_used_is_one_sentence(files, words, sentence, folder, refused):
    assert sentence in refused("csv", put(folder, files), *words)


TABLES = int(os.environ.get("TABLES", "20"))
"""Generated tables; TABLES=2000 tries as many."""
STEP_S = 0.02


@st.composite
def tables(draw):
    """Counts, and a text of them: any order of the columns, separator, decimal sign and
    unit, and columns that are no taxels."""
    rows = draw(st.integers(4, 12))
    taxels = draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    values = rng.integers(0, 1000, (rows, taxels))
    table = pd.DataFrame(values, columns=[f"p{i + 1}" for i in range(taxels)])
    table["t"] = STEP_S * draw(st.sampled_from([1.0, 1e3, 1e6])) * np.arange(rows)
    for name in draw(st.sets(st.sampled_from(["label", "", "temperature", "frame"]))):
        table[name] = rng.integers(0, 9, rows)
    mark = draw(st.sampled_from([",", ";", "\t", "|"]))
    decimal = "." if mark == "," else draw(st.sampled_from([".", ","]))
    columns = draw(st.permutations(sorted(table)))
    return values, table.to_csv(columns=columns, sep=mark, decimal=decimal, index=False)


@settings(max_examples=TABLES, deadline=None)
@given(table=tables())
def test_generated_tables_arrive_as_they_were(tmp_path_factory, table):
    values, contents = table
    folder = tmp_path_factory.mktemp("table") / "in"
    put(folder, {"cup.csv": contents})
    status, recordings = imported(folder)
    assert status == 0
    recording = recordings["cup"]
    assert (recording.frames.reshape(values.shape) == values).all()
    assert recording.t == pytest.approx(STEP_S * np.arange(len(values)))


ROWS = range(8)
UNNAMED = {
    "rows": [[f"{i} {7 - i % 2}\n" for i in ROWS]],
    "times": [[f"{7 - i % 2} {20 * i}\n" for i in ROWS]],
    "class": [[f"{7 - i % 2} {label}\n" for i in ROWS] for label in (1, 2)],
}


@pytest.mark.parametrize("kind", UNNAMED)
def test_a_column_without_a_name_that_may_be_no_taxel_is_asked_for(
    folder,
    refusal,
    kind,
):
    files = {f"{i}.txt": "".join(rows) for i, rows in enumerate(UNNAMED[kind])}
    put(folder, files)
    words = ("import", "csv", folder, "--out", folder.parent / "out", *RATE)
    column = 1 if kind == "rows" else 2
    sentence = (
        f"column {column} counts up, or tells the trials apart; name the taxels by"
    )
    assert sentence in refusal(*words)
    assert main([*map(str, words), "--taxels", "1-2"]) == 0


def test_a_column_that_stays_the_same_in_all_trials_is_a_taxel(folder):
    rows = "".join(f"{7 - i % 2} 5\n" for i in ROWS)
    put(folder, {"1.txt": rows, "2.txt": rows + "3 5\n"})
    status, recordings = imported(folder, *RATE)
    assert status == 0
    assert recordings["1"].frames.shape == (8, 1, 2)


def test_numbers_of_columns_count_in_the_file_as_it_stands(folder):
    put(folder, {"all.csv": "trial,object,t,p1,p2\na,box,0,1,2\na,box,0.1,51,62\n"})
    _, recordings = imported(folder, "--taxels", "4-5")
    assert recordings["a"].frames[-1].tolist() == [[51, 62]]


def test_a_number_among_words_is_a_label_where_it_stays_the_same(folder):
    rows = [(trial, trial, f"at {t}", t, t) for trial in ("7", "cup") for t in (0, 10)]
    put(folder, {"all.csv": text(rows, head="trial,kind,phase,t,p1")})
    _, recordings = imported(folder)
    assert recordings["7"].labels == {"kind": "7"}
    assert recordings["cup"].labels == {"kind": "cup"}


def test_numbers_that_a_parquet_file_holds_as_texts_are_labels(folder):
    pytest.importorskip("pyarrow")
    rows = [("a", "1", t, t) for t in (0, 10)]
    rows += [("b", None, t, t) for t in (0, 10)]
    table = pd.DataFrame(rows, columns=["trial", "softness", "t", "p1"])
    table.astype({"softness": "category"}).to_parquet(folder / "all.parquet")
    _, recordings = imported(folder)
    assert recordings["a"].labels == {"softness": "1"}
    assert recordings["b"].labels == {}


def test_one_value_in_a_row_has_the_time_that_is_called_one(folder, capsys):
    rows = [("a", 3, t, taxel, t) for t in (0, 10, 20) for taxel in (0, 1)]
    put(folder, {"all.csv": text(rows, head="trial,class,t,taxel,value")})
    _, recordings = imported(folder)
    assert recordings["a"].t.tolist() == [0.0, 0.01, 0.02]
    assert 'ignored: "class"' in capsys.readouterr().out


def test_a_bad_trial_of_a_long_table_stops_none_of_the_others(folder, capsys):
    rows = [("a", 0, 1), ("a", 10, 2), ("b", 0, 1), ("b", 10, 2), ("b", 0, 3)]
    put(folder, {"all.csv": "# me\n" + text(rows, head="trial,t,p1")})
    status, recordings = imported(folder)
    assert status == 1
    assert list(recordings) == ["a"]
    sentence = (
        "all.csv: trial b: its time goes back by 0.01 s at line 7; split it there"
    )
    assert sentence in capsys.readouterr().err


def test_dates_that_run_within_a_trial_are_its_times(folder):
    day = "2024-02-01T00:00"
    rows = [("a", day, f"2024-03-01T10:00:00.{n}", n) for n in range(3)]
    put(folder, {"all.csv": text(rows, head="trial,made,when,p1")})
    _, recordings = imported(folder)
    assert recordings["a"].t == pytest.approx([0.0, 0.1, 0.2])
    assert recordings["a"].labels == {"made": day}


@pytest.mark.parametrize(
    ("table", "sentence"),
    [
        (
            text([("a", 0, 1, 5), ("a", 0, 1, 6)], head="trial,t,taxel,value"),
            "two values of taxel 1 at time 0; a column trial would tell",
        ),
        (
            text([("a", i, i, 1) for i in range(2)], head="trial,t,taxel,value"),
            "the taxels need times in common",
        ),
        (
            text([("a", 1, 2, 1, 1)], head="trial,frame,step,taxel,value"),
            "give --time COL",
        ),
        (
            text([("a", "box", 0, 1), ("a", "cup", 1, 1)], head="trial,object,t,p1"),
            "object changes, as in ['box', 'cup']",
        ),
        (
            text([("a", 0, 1), ("", 1, 1), ("", 2, 1)], head="trial,t,p1"),
            "all.csv: line 3 has no trial; enter it, or leave the row out",
        ),
        (
            text([("a", 0, 1, 5), ("a", 1, "", 6)], head="trial,t,taxel,value"),
            "all.csv: trial a: line 3 has no taxel; enter it, or leave the row out",
        ),
    ],
)
def test_a_long_table_that_contradicts_itself_is_refused(
    folder,
    refused,
    table,
    sentence,
):
    assert sentence in refused("csv", put(folder, {"all.csv": table}))


def test_labels_and_the_names_of_trials_stand_as_they_are(folder):
    labels = {"007": "None", "7": "NA", "8": "cup"}
    rows = [(trial, label, t, t) for trial, label in labels.items() for t in (0, 1)]
    put(folder, {"all.csv": text(rows, head="trial,object,t,p1")})
    _, recordings = imported(folder, "--time-unit", "s")
    assert {
        name: trial.labels["object"] for name, trial in recordings.items()
    } == labels


def test_angles_beyond_a_turn_are_degrees_or_a_mistake(folder, refused):
    put(folder, {"cup_1.csv": "t,s1,q\n0,1,90\n0.1,2,91\n"})
    words = ("--taxels", "s1", "--joints", "q")
    assert "--degrees" in refused("csv", folder, *words)
    _, recordings = imported(folder, *words, "--degrees")
    assert recordings["cup_1"].joints[0, 0] == pytest.approx(np.pi / 2)


def test_onsets_from_outside_are_kept(folder):
    put(folder, {"cup_1.csv": "t,s1,grip\n0,1,0\n0.1,2,0\n0.2,2,1\n0.3,2,1\n"})
    _, recordings = imported(folder, "--onset-column", "grip")
    onset = recordings["cup_1"].meta["onset"]
    assert onset == {"source": "event", "times_s": [pytest.approx(0.2)]}
    _, recordings = imported(folder, "--onset", "first")
    assert recordings["cup_1"].meta["onset"] == {"source": "first", "times_s": [0.0]}
