"""Tables of values: the same trial in every form, what is asked for with the option
that mends it, and what cannot be used."""

import gzip
import io
import json
import lzma
import os
import tracemalloc
import zipfile

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat

from edge.record.recording import load
from tests.conftest import python
from train.__main__ import main
from train.commands import import_
from train.importers import csv

N = 24
T = np.arange(N) / 100
COUNTS = np.random.default_rng(5).integers(0, 3, (N, 4))
"""A touch in the second half."""
COUNTS[12:] += [40, 300, 150, 80]
PIXELS = COUNTS.reshape(N, 2, 2)
TAXELS = ["p1", "p2", "p3", "p4"]
TABLE = pd.DataFrame(COUNTS, columns=TAXELS)
TABLE.insert(0, "t", T)
NS = 1_700_000_000_985_000_000 + 10**7 * np.arange(N)
RATE = ("--rate", "100")


def text(table=TABLE, **options):
    """A table of commas."""
    return table.to_csv(index=False, **options)


def stored(save, *contents, **options):
    """The bytes that a function saves."""
    file = io.BytesIO()
    save(file, *contents, **options)
    return file.getvalue()


def timed(t, name="t"):
    """The table with other times, whose column has another name."""
    return TABLE.assign(t=t).rename(columns={"t": name})


def lines(form):
    """A line for each frame."""
    return "".join(form.format(t, *row) for t, row in zip(T, COUNTS, strict=True))


def movie(form):
    frames = "".join(
        f"\nFrame {i}{form.format(*row)}" for i, row in enumerate(COUNTS.tolist(), 1)
    )
    return f"SECONDS_PER_FRAME 0.01\nASCII_DATA @@\n{frames}@@"


def zipped(content):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("a.csv", content)
    return file.getvalue()


PLAIN = text()
STAMPS = timed(NS // 10**9)
STAMPS.insert(1, "ns", NS % 10**9)
DAYS = timed(pd.to_datetime(NS).astype(str), "zeit").astype(
    dict.fromkeys(TAXELS, float)
)
LONG = TABLE.melt("t", var_name="sensor_id")[::-1]
PLX = "CLEARDATA\nLABEL,Date,millis,p1,p2,p3,p4\nRESETTIMER\nDATA,DATE,"
ECHO = timed(NS, "%time").assign(id="pad").rename(columns=lambda name: f"field.{name}")
SAMPLE = {"interval_ms": 10, "sensors": [{"name": name} for name in TAXELS]}
LISTS = TABLE[["t"]].assign(skin=[{"p": row} for row in COUNTS.tolist()])
FORMS = {
    "plain": ("cup_1.csv", PLAIN),
    "an index without a name": ("cup_1.csv", TABLE.to_csv()),
    "a class among the columns": ("cup_1.csv", text(TABLE.assign(label=3))),
    "BOM, CRLF, semicolons, decimal commas, dates": (
        "cup_1.csv",
        "\ufeff" + text(DAYS, sep=";", decimal=",", lineterminator="\r\n"),
    ),
    "UTF-16": ("cup_1.txt", text(sep="\t").encode("utf-16")),
    "names in a comment": ("cup_1.dat", "# me\n# " + text(sep=" ")),
    "numbers alone": ("cup_1.txt", text(sep="|", header=False), "--time", "1"),
    "lines above, among and below": (
        "cup_1.csv",
        "Device: X\nGain,2,dB\n\n" + PLAIN.replace("\n0.05", "\n0\n\n0.05") + "end\n",
    ),
    "a row of units": (
        "cup_1.csv",
        text(timed(10_000 * np.arange(N), "Time")).replace(
            "p4\n", "p4\n[us],N,N,N,N\n"
        ),
    ),
    "units in names": (
        "cup_1.csv",
        text(TABLE.set_axis(["Zeit (s)", *(f"F {i} [N]" for i in range(4))], axis=1)),
    ),
    "ms since 1970": ("cup_1.csv", text(timed(NS // 10**6))),
    "rostopic echo -p": ("cup_1.csv", text(ECHO).replace("field.%", "%")),
    "ros2 topic echo": ("cup_1.csv", text(STAMPS, header=False), "--taxels", "3-6"),
    "of a frame": (
        "cup_1.csv",
        text(STAMPS, header=False).replace("5000000,", "5000000,pad,"),
        "--taxels",
        "4-7",
    ),
    "PLX-DAQ": (
        "cup_1.csv",
        PLX
        + text(timed(10 * np.arange(N)), header=False).replace("\n", "\nDATA,DATE,"),
    ),
    "serial monitor": (
        "cup_1.log",
        "Hi\n" + lines("12:00:{0:06.3f} -> p1:{1}\tp2:{2}\tp3:{3}\tp4:{4}\n"),
    ),
    "serial plotter": ("cup_1.log", lines("p1={1}, p2={2}, p3={3}, p4={4}\n"), *RATE),
    "Tekscan": ("cup_1.asf", movie("\n{},{}\n{},{}\n")),
    "Tekscan without a step": ("cup_1.txt", movie("\n{}  {}\n{}  {}\n"), *RATE),
    "Edge Impulse": (
        "cup.5ab.json",
        json.dumps({"payload": SAMPLE | {"values": COUNTS.tolist()}}),
    ),
    "JSON": ("cup_1.json", TABLE.to_json(orient="records")),
    "JSON of columns": ("cup_1.json", json.dumps(TABLE.to_dict("list"), indent=1)),
    "JSON lines": ("cup_1.jsonl", LISTS.to_json(orient="records", lines=True)),
    "a row for each value": ("cup_1.csv", text(LONG)),
    "long table": (
        "all.csv",
        "trial,object," + PLAIN.replace("\n0", "\n7,cup,0"),
        "--taxels",
        "4-7",
    ),
    "gzip": ("cup_1.csv.gz", gzip.compress(PLAIN.encode())),
    "xz": ("cup_1.csv.xz", lzma.compress(PLAIN.encode())),
    "zip": ("cup_1.csv.zip", zipped(PLAIN)),
    "NPY": ("cup/3.npy", stored(np.save, PIXELS), *RATE),
    "NPZ": ("cup_1.npz", stored(np.savez, t=T, skin=COUNTS.T)),
    "MAT of two orientations": (
        "cup_1.mat",
        stored(savemat, {"frames": PIXELS, "pose": np.zeros((6, N)), "by": "me"}),
        *(*RATE, "--taxels", "frames", "--joints", "pose"),
    ),
}


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


def flat(recording):
    """(n, taxels) counts."""
    return recording.frames.reshape(len(recording.t), -1).tolist()


def require_the_trial(folder, *words):
    """Import the one trial, which has the counts and the times."""
    status, recordings = imported(folder, *words)
    assert status == 0
    (trial,) = recordings.values()
    assert flat(trial) == COUNTS.tolist()
    assert trial.t == pytest.approx(T, abs=1e-6)
    assert trial.labels == {"object": "cup"}


@pytest.mark.parametrize("form", FORMS)
def test_the_same_trial_comes_out_of_every_form(form, folder):
    name, content, *words = FORMS[form]
    put(folder, {name: content})
    require_the_trial(folder, *words)


@pytest.mark.parametrize(
    ("name", "words"), [("{1:.2f}.csv", ()), ("frame-{0:04}.csv", RATE)]
)
def test_a_folder_for_each_trial_has_a_file_for_each_frame(folder, name, words):
    frames = zip(T, PIXELS, strict=True)
    files = {
        f"cup_1/{name.format(i, 8.0 + t)}": text(pd.DataFrame(frame), header=False)
        for i, (t, frame) in enumerate(frames)
    }
    put(folder, files)
    require_the_trial(folder, "--frames", *words)


def test_the_index_of_a_parquet_table_is_a_column(folder):
    pytest.importorskip("pyarrow")
    TABLE.set_index("t").to_parquet(folder / "cup_1.parquet")
    require_the_trial(folder)


HEAD = "t,p1,p2,p3,p4\n"
MENDS = {
    "raw values": (text(TABLE.assign(**(700 - TABLE[TAXELS]))), "--falls"),
    "no time": (text(TABLE[TAXELS]), "--rate 100"),
    "another name of the time": (text(timed(T, "wann (?)")), "--time 1"),
    "a time that stands still": (text(timed(np.arange(N) // 10 / 10)), "--rate 100"),
    "units in doubt": (text(timed(range(N))), "--time-unit s"),
    "fingers": (PLAIN.replace(HEAD, "t,a,b,c,d\n"), "--taxels a-d"),
    "names with commas": (
        text(sep=";").replace(HEAD.replace(",", ";"), "t;(0,0);(0,1);(1,0);(1,1)\n"),
        "--taxels 2-5",
    ),
    "two sensors": (PLAIN.replace("p3,p4", "q1,q2"), "--taxels p1-p2"),
    "degrees": (text(TABLE.assign(elbow=40.0 + T)), "--degrees", "--joints", "elbow"),
    "a label that changes": (text(TABLE.assign(label=["a", "b"] * 12)), "--label 1"),
    "rows counted in a column": (
        TABLE[TAXELS].to_csv(header=False),
        "--taxels 2,3,4,5",
        *RATE,
    ),
}


@pytest.mark.parametrize("kind", MENDS)
def test_what_is_unclear_is_asked_for_with_the_option_that_mends_it(
    kind, folder, refused
):
    content, option, *words = MENDS[kind]
    put(folder, {"cup_1.csv": content})
    message = refused("csv", folder, *words)
    assert "cup_1.csv" in message
    assert option in message
    status, recordings = imported(folder, *words, *option.split())
    assert status == 0
    (trial,) = recordings.values()
    assert trial.frames.max() >= 280
    assert trial.frames[:11].max() <= 3
    assert trial.labels == {"object": "cup"}


@pytest.mark.parametrize(
    ("files", "words", "word"),
    [
        ({"1.npy": stored(np.save, np.zeros((0, 3)))}, RATE, "1.npy"),
        ({"1.txt": "1 2\n"}, (*RATE, "--shape", "2x2"), "--shape"),
        ({"all.csv": "trial,t,p1\na,0,1\na,1,2\n"}, ("--time", "1"), "column trial"),
        ({}, (), "in: holds no file .csv"),
        ({"a/0.csv": "1 2\n", "a/b.csv": "1 2\n"}, ("--frames",), "--rate"),
        ({"a/0.csv": "1 2\n", "a/1.csv": "1\n2\n"}, ("--frames",), "1.csv"),
        ({"a/0.npy": stored(np.save, np.array(["x"]))}, ("--frames",), "0.npy"),
        ({"a/1.png": b"\x89PNG"}, ("--frames", *RATE), "picture"),
        ({"1.txt": "1 2\n", "labels.csv": "trial,who\n2,me\n"}, RATE, "labels.csv"),
        (
            {"1.txt": "1 2\n", "labels.csv": "trial,object\n1,box\n1,cup\n"},
            RATE,
            "labels.csv, line 3",
        ),
        ({"all.csv": "trial,p1\n../1,2\n"}, RATE, "'../1'"),
        # Long tables that contradict themselves.
        ({"all.csv": "trial,t,taxel,value\na,0,1,5\na,0,1,6\n"}, (), "taxel 1"),
        ({"all.csv": "trial,t,taxel,value\na,0,0,1\na,1,1,1\n"}, (), "in common"),
        ({"all.csv": "trial,frame,step,taxel,value\na,1,2,1,1\n"}, (), "--time COL"),
        (
            {"all.csv": "trial,object,t,p1\na,box,0,1\na,cup,1,1\n"},
            (),
            "object changes",
        ),
        ({"all.csv": "trial,t,p1\na,0,1\n,1,1\n,2,1\n"}, (), "line 3 has no trial"),
        (
            {"all.csv": "trial,t,taxel,value\na,0,1,5\na,1,,6\n"},
            (),
            "line 3 has no taxel",
        ),
        # Hostile files of each form.
        ({"a.json": "[" * 9000}, RATE, "a.json"),
        ({"a.json": '{"t": 0, "s": [1, [2]]}'}, (), "a.json"),
        ({"a.npz": b"PK\x03\x04" + bytes(40)}, RATE, "a.npz"),
        ({"a.mat": b"MATLAB 5.0 MAT-file" + bytes(200)}, RATE, "a.mat"),
        ({"a.mat": b"MATLAB 7.3 MAT-file" + bytes(600)}, RATE, "a.mat"),
        ({"a.parquet": b"PAR1" + bytes(40)}, RATE, "a.parquet"),
        ({"a.csv.gz": b"\x1f\x8b" + bytes(40)}, RATE, "a.csv.gz"),
        ({"a.csv.zip": b"PK" + bytes(40)}, RATE, "a.csv.zip"),
        ({"a.csv": "CLEARDATA\nLABEL,t,s1\nDATA,x\n"}, RATE, "a.csv"),
    ],
)
def test_what_cannot_be_used_is_one_sentence(files, words, word, folder, refused):
    assert word in refused("csv", put(folder, files), *words)


def test_the_lines_of_pandas_make_a_recording(folder, refused):
    put(folder, {"cup_1.csv": "t,thumb,index\n0,1,2\n0.1,3,4\n"})
    refused("csv", folder)
    program = csv.PANDAS.partition("\n")[2].replace('"s1", "s2"', '"thumb", "index"')
    python("-c", program, cwd=folder)
    assert flat(load(folder / "cup_1.npz")) == [[1, 2], [3, 4]]


def test_one_bad_trial_stops_none_of_the_others(folder, capsys):
    files = {"1.txt": "1 2\n", "2.txt": "1 2 3\n", "3.txt": "1 2\n"}
    put(folder, files)
    status, recordings = imported(folder, *RATE)
    assert status == 1
    assert list(recordings) == ["1", "3"]
    assert "2.txt" in capsys.readouterr().err
    back = "# me\ntrial,t,p1\na,0,1\na,10,2\nb,0,1\nb,10,2\nb,0,3\n"
    put(folder, {"all.csv": back})
    status, recordings = imported(folder)
    assert status == 1
    assert "a" in recordings
    message = capsys.readouterr().err
    assert "all.csv: trial b" in message
    assert "line 7" in message


def test_neither_values_nor_recordings_stay_in_the_memory(folder, monkeypatch):
    """Sixteen megabytes of values are imported within four."""
    held = []

    def look(recordings):
        held.append(tracemalloc.get_traced_memory()[0])
        return ""

    monkeypatch.setattr(import_, "with_thresholds", look)
    for i in range(16):
        np.save(folder / f"{i}.npy", np.full((2000, 64), i, np.uint16))
    tracemalloc.start()
    imported(folder, *RATE, "--preview")
    tracemalloc.stop()
    assert held[0] < 4e6


TABLES = int(os.environ.get("TABLES", "20"))
"""Generated tables; TABLES=2000 tries as many."""
STEP_S = 0.02


@st.composite
def tables(draw):
    """Counts, and a text of them: any order of the columns, separator, decimal sign and
    unit, and columns that are no taxels."""
    count = draw(st.integers(4, 12))
    taxels = draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 10**6)))
    values = rng.integers(0, 1000, (count, taxels))
    frames = pd.DataFrame(values, columns=[f"p{i + 1}" for i in range(taxels)])
    frames["t"] = STEP_S * draw(st.sampled_from([1.0, 1e3, 1e6])) * np.arange(count)
    for name in draw(st.sets(st.sampled_from(["label", "", "temperature", "frame"]))):
        frames[name] = rng.integers(0, 9, count)
    mark = draw(st.sampled_from([",", ";", "\t", "|"]))
    decimal = "." if mark == "," else draw(st.sampled_from([".", ","]))
    columns = draw(st.permutations(sorted(frames)))
    return values, frames.to_csv(
        columns=columns, sep=mark, decimal=decimal, index=False
    )


@settings(max_examples=TABLES, deadline=None)
@given(table=tables())
def test_generated_tables_arrive_as_they_were(tmp_path_factory, table):
    values, contents = table
    folder = tmp_path_factory.mktemp("table") / "in"
    put(folder, {"cup.csv": contents})
    status, recordings = imported(folder)
    assert status == 0
    assert flat(recordings["cup"]) == values.tolist()
    assert recordings["cup"].t == pytest.approx(STEP_S * np.arange(len(values)))


@pytest.mark.parametrize(
    ("contents", "is_asked"),
    [
        ([[[7 - i % 2, 20 * i] for i in range(8)]], True),  # times
        ([[[7 - i % 2, label] for i in range(8)] for label in (1, 2)], True),  # a class
        ([[[7 - i % 2, 5] for i in range(n)] for n in (8, 9)], False),
    ],
)
def test_a_column_without_a_name_that_may_be_no_taxel_is_asked_for(
    folder, refused, contents, is_asked
):
    files = {
        f"{i}.txt": text(pd.DataFrame(trial), header=False)
        for i, trial in enumerate(contents)
    }
    put(folder, files)
    if is_asked:
        assert "column 2" in refused("csv", folder, *RATE)
    else:
        assert imported(folder, *RATE)[1]["0"].frames.shape == (8, 1, 2)


def test_joint_angles_in_rows_of_their_own_are_interpolated(folder, capsys):
    content = "time_s,s1,s2,q\n0.0,,,0.0\n0.1,1,2,\n0.2,,,0.2\n0.9,3,4,\n"
    put(folder, {"cup_1.csv": content})
    _, recordings = imported(folder, "--taxels", "s1,s2", "--joints", "q")
    assert flat(recordings["cup_1"]) == [[1, 2], [3, 4]]
    np.testing.assert_allclose(recordings["cup_1"].joints, [[0.1], [np.nan]])
    assert "1 of 2 frames" in capsys.readouterr().out


def test_joints_and_files_beside(folder):
    files = {
        "a.csv": "left,right,q.1,q.2\n0,nan,90,-90\n0.5,nan,90,-90\n",
        "skin.json": '{"rows": 2, "cols": 1, "threshold_counts": 3}',
    }
    put(folder, files)
    words = ["--joints", "q", "--degrees", "--scale", "10", "--taxels", "left,right"]
    _, recordings = imported(folder, *RATE, *words)
    trial = recordings["a"]
    assert trial.frames[:, :, 0].tolist() == [[0, 0], [5, 0]]
    assert trial.valid[:, :, 0].tolist() == [[True, False]] * 2
    assert trial.joints == pytest.approx(np.radians([[90, -90]] * 2))
    assert trial.layout.threshold_counts == 3


def test_labels_and_the_names_of_trials_stand_as_they_are(folder):
    lines = [
        f"{trial},2024-02-01T00:00,at {i},2024-03-01T10:00:00.{i},{i}"
        for trial in ("007,None", "7,NA", "8,cup")
        for i in range(3)
    ]
    put(folder, {"all.csv": "\n".join(["trial,object,made,phase,when,p1", *lines])})
    _, recordings = imported(folder)
    objects = {name: trial.labels["object"] for name, trial in recordings.items()}
    assert objects == {"007": "None", "7": "NA", "8": "cup"}
    assert recordings["7"].labels["made"] == "2024-02-01T00:00"
    assert recordings["7"].t == pytest.approx([0.0, 0.1, 0.2])


def test_trials_and_labels_in_parquet_are_texts(folder):
    pytest.importorskip("pyarrow")
    content = [["a", "1", t, t] for t in (0, 10)] + [["b", None, t, t] for t in (0, 10)]
    frames = pd.DataFrame(content, columns=["trial", "softness", "t", "p1"])
    frames.astype({"softness": "category"}).to_parquet(folder / "all.parquet")
    _, recordings = imported(folder)
    assert recordings["a"].labels == {"softness": "1"}
    assert recordings["b"].labels == {}


def test_onsets_from_outside_are_kept(folder):
    put(folder, {"cup_1.csv": "t,s1,grip\n0,1,0\n0.1,2,1\n0.2,2,1\n0.3,2,0\n0.4,2,1\n"})
    _, recordings = imported(folder, "--onset-column", "grip")
    onset = recordings["cup_1"].meta["onset"]
    assert onset == {
        "source": "event",
        "times_s": [pytest.approx(0.1), pytest.approx(0.4)],
    }
    _, recordings = imported(folder, "--onset", "first")
    assert recordings["cup_1"].meta["onset"] == {"source": "first", "times_s": [0.0]}
