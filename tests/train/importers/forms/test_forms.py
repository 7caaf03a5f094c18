"""Files as other programs write them, each with its signature."""

import json

import numpy as np
import pandas as pd
import pytest

from edge.errors import InputError
from train.importers.forms import (
    edge_impulse,
    frames,
    json_lines,
    long,
    parquet,
    plx_daq,
    ros2_echo,
    serial,
    tables_in,
    tekscan,
    unread,
)
from train.importers.forms.file import File
from train.importers.options import TableOptions

T = 0.01 * np.arange(40)
COUNTS = np.arange(160).reshape(40, 4)


def sample(folder):
    values = COUNTS.tolist()
    sensors = [{"name": f"s{i}", "units": "N"} for i in range(1, 5)]
    payload = {
        "device_type": "X",
        "interval_ms": 10,
        "sensors": sensors,
        "values": values,
    }
    text = json.dumps(
        {"protected": {"ver": "v1"}, "signature": "0", "payload": payload}
    )
    return edge_impulse, "hard.5ab.json", text


def object_a_line(folder):
    rows = zip(T, COUNTS, strict=True)
    lines = [json.dumps({"t": t, "skin": {"p": row.tolist()}}) for t, row in rows]
    return json_lines, "cup.jsonl", "\n".join(lines) + "\n"


def list_of_objects(folder):
    rows = [{"t": t, "p": row.tolist()} for t, row in zip(T, COUNTS, strict=True)]
    return json_lines, "cup.json", json.dumps(rows, indent=1)


def movie(mark, head):
    lines = [
        "DATA_TYPE MOVIE",
        "ROWS 2",
        "COLS 2",
        "SECONDS_PER_FRAME 0.01",
        "ASCII_DATA @@",
    ]
    for i, row in enumerate(COUNTS.reshape(40, 2, 2)):
        lines += [
            "",
            head.format(i + 1, T[i]),
            *(mark.join(map(str, cells)) for cells in row),
        ]
    return "\n".join([*lines, "@@"])


def tekscan_commas(folder):
    return tekscan, "cup.asf", movie(",", "Frame {0}")


def tekscan_blanks(folder):
    return tekscan, "cup.txt", movie("  ", "Frame {0}, Time: {1:.2f} s")


def plx(folder):
    rows = zip(T, COUNTS, strict=True)
    data = [f"DATA,DATE,TIME,{','.join(map(str, c))},{1000 * t:.0f}" for t, c in rows]
    lines = ["CLEARDATA", "LABEL,Date,Time,p1,p2,p3,p4,millis", "RESETTIMER", *data]
    return plx_daq, "cup.csv", "\n".join(lines)


def echo(name):
    def form(folder):
        ns = np.rint(1e9 * (T + 0.985)).astype(int)
        stamps = zip(ns // 10**9 + 1_700_000_000, ns % 10**9, COUNTS, strict=True)
        lines = [
            f"{s},{rest},{name}{','.join(map(str, row))}" for s, rest, row in stamps
        ]
        return ros2_echo, "cup.csv", "\n".join(lines)

    return form


@pytest.mark.parametrize(
    "write",
    [
        sample,
        object_a_line,
        list_of_objects,
        tekscan_commas,
        tekscan_blanks,
        plx,
        echo(""),
        echo("skin,"),
    ],
)
def test_each_form_is_told_by_its_signature_and_read(tmp_path, write):
    form, name, text = write(tmp_path)
    path = tmp_path / name
    path.write_text(text)
    assert form.is_form(File(path))
    (table,) = tables_in(path, TableOptions())
    time = next(n for n in table.names if n in ("t", "time_s", "millis"))
    seconds = table.data[time].to_numpy() * (1e-3 if time == "millis" else 1.0)
    assert seconds - seconds[0] == pytest.approx(T)
    values = table.data.drop(columns=time)
    assert values.to_numpy().tolist() == COUNTS.tolist()


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("12:00:{t:06.3f} -> {a},{b}", ["2", "3"]),
        ("12:00:{t:06.3f} -> s1:{a}\ts2:{b}", ["s1", "s2"]),
        ("s1:{a}, s2: {b}", ["s1", "s2"]),
        ("s1={a} s2={b}", ["s1", "s2"]),
    ],
)
def test_lines_of_a_serial_monitor(tmp_path, line, names):
    rows = [line.format(t=t, a=i, b=2 * i) for i, t in enumerate(T)]
    (tmp_path / "cup.log").write_text("\n".join(["Starting", *rows]))
    assert serial.is_form(File(tmp_path / "cup.log"))
    (table,) = tables_in(tmp_path / "cup.log", TableOptions())
    assert table.data[names].to_numpy().tolist() == [[i, 2 * i] for i in range(40)]


def test_a_restart_of_the_arduino_begins_another_trial(tmp_path):
    block = "CLEARDATA\nLABEL,p1,millis\nDATA,1,0\nDATA,2,10\n"
    (tmp_path / "cup.csv").write_text(block * 2)
    names = [table.name for table in tables_in(tmp_path / "cup.csv", TableOptions())]
    assert names == ["cup_001", "cup_002"]


def test_cells_that_a_sensor_does_not_have_are_missing(tmp_path):
    text = movie(",", "Frame {0}").replace("0,1\n", "B,1\n", 1)
    (tmp_path / "a.asf").write_text(text)
    (table,) = tables_in(tmp_path / "a.asf", TableOptions())
    assert np.isnan(table.data["frame.1"].iloc[0])
    assert table.shape == (2, 2)


@pytest.mark.parametrize(
    ("name", "data", "word"),
    [
        ("a.png", b"\x89PNG", "picture"),
        ("a.xlsx", b"PK", "spreadsheet"),
        ("a.mcap", b"", "import rosbag"),
        ("a.asf", b"\0\1", "export it as text"),
        ("a.pkl", b"\x80", "run code"),
        ("a.csv", b"\0", "no known form"),
        ("a.json", b'{"a": [1, 2}', "an object a line"),
        ("a.asf", b"Frame 1\n1,2\n3\nFrame 2\n1,2\n", "export it again"),
    ],
)
def test_what_is_seen_and_not_read_is_named_with_the_way_out(
    tmp_path, name, data, word
):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError) as error:
        list(tables_in(tmp_path / name, TableOptions()))
    assert str(tmp_path / name) in str(error.value)
    assert word in str(error.value)
    assert "copy it again" not in str(error.value)


def test_pictures_of_a_folder_are_named(tmp_path):
    (tmp_path / "1.png").write_bytes(b"\x89PNG")
    with pytest.raises(InputError, match=unread.PICTURE):
        list(frames.tables(tmp_path, TableOptions(rate=30)))


@pytest.mark.parametrize("taxel", ["taxel", "sensor_id", "Channel"])
def test_a_row_for_each_value_becomes_a_column_for_each_taxel(tmp_path, taxel):
    rows = [f"{t},{i},{10 * t + i}" for t in range(2) for i in (10, 9)]
    (tmp_path / "a.csv").write_text("\n".join([f"t,{taxel},value", *rows]))
    (table,) = tables_in(tmp_path / "a.csv", TableOptions())
    assert table.names == ["t", "9", "10"]
    assert table.data["10"].tolist() == [10, 20]
    assert long.plain(7.0) == "7"


def test_the_index_of_a_parquet_table_is_a_column(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "a.parquet"
    data = pd.DataFrame({"t": T, "p1": COUNTS[:, 0]})
    data.set_index("t").to_parquet(path)
    assert parquet.is_form(File(path))
    (table,) = tables_in(path, TableOptions())
    assert table.names == ["t", "p1"]
