"""What forms tell beside the frames, and files that are seen and not read."""

import numpy as np
import pytest

from edge.errors import InputError
from train.importers.forms import long, tables_in
from train.importers.options import TableOptions


def tables_of(folder, name, data):
    """The tables of a file."""
    content = data if isinstance(data, bytes) else data.encode()
    (folder / name).write_bytes(content)
    return list(tables_in(folder / name, TableOptions()))


def test_a_restart_of_the_arduino_begins_another_trial(tmp_path):
    block = "CLEARDATA\nLABEL,p1,millis\nDATA,1,0\nDATA,2,10\n"
    names = [table.name for table in tables_of(tmp_path, "cup.csv", block * 2)]
    assert names == ["cup_001", "cup_002"]


def test_cells_that_a_sensor_does_not_have_are_missing(tmp_path):
    movie = "Frame 1\nB,1\n2,3\nFrame 2\n1,1\n1,1\n"
    (table,) = tables_of(tmp_path, "a.asf", movie)
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
    with pytest.raises(InputError) as error:
        tables_of(tmp_path, name, data)
    assert str(tmp_path / name) in str(error.value)
    assert word in str(error.value)
    assert "copy it again" not in str(error.value)


def test_taxels_of_a_row_for_each_value_stand_in_the_order_of_their_numbers(tmp_path):
    rows = [f"{t},{i},{10 * t + i}" for t in range(2) for i in (10, 9)]
    (table,) = tables_of(tmp_path, "a.csv", "\n".join(["t,Channel,value", *rows]))
    assert table.names == ["t", "9", "10"]
    assert table.data["10"].tolist() == [10, 20]
    assert long.plain(7.0) == "7"


def test_a_long_line_of_words_is_no_log_of_pairs(tmp_path):
    """A pattern that goes back over it would take the square of its length."""
    words = "a " * 20_000
    with pytest.raises(InputError):
        tables_of(tmp_path, "words.csv", f"{words}\n" * 3)
