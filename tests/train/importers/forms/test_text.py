"""Texts as people save them: heads, odd lines, and what is no table."""

import gzip
import tracemalloc
import zipfile

import numpy as np
import pytest

from edge.errors import InputError
from train.importers.forms import file as files
from train.importers.forms import tables_in
from train.importers.forms.text import table_of
from train.importers.options import TableOptions


def read(folder, content, name="a.csv"):
    """The first table of a file."""
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return next(tables_in(path, TableOptions()))


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ("sep=;\nt;p1\n0;1\n1;2\n", ["t", "p1"]),
        ("t,Unnamed: 1,p1\n0,,1\n1,7,2\n", ["t", "column 2 unnamed", "p1"]),
        ("t,1,2\n0,5,5\n1,5,5\n", ["t", "1", "2"]),
        # A first row of values is no header.
        ("1,a,5\n2,a,6\n", ["1", "2", "3"]),
        (",2,5\n1,2,6\n", ["1", "2", "3"]),
        ("2024-01-01T10:00,3,4\n" * 2, ["1", "2", "3"]),
    ],
)
def test_the_names_stand_above_the_numbers(tmp_path, content, names):
    table = read(tmp_path, content)
    assert table.names == names
    assert table.named == (names[0] != "1")
    assert table.numbers(names[-1:])[0, 0] in (1, 4, 5)


def test_an_archive_holds_one_file(tmp_path):
    for name in ("a.csv", "b.csv"):
        with zipfile.ZipFile(tmp_path / "a.csv.zip", "a") as archive:
            archive.writestr(name, "t,p1\n0,1\n")
    with pytest.raises(InputError, match="holds 2 files"):
        next(tables_in(tmp_path / "a.csv.zip", TableOptions()))


def test_what_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(files, "LARGEST_BYTES", 1 << 20)
    with pytest.raises(InputError, match="more than 1 MB"):
        read(tmp_path, gzip.compress(b"1" * (2 << 20)), "a.csv.gz")


def test_how_a_text_was_read_is_said(tmp_path):
    table = read(tmp_path, "zeit;p1\n0,0;1,5\n0,01;2,5\n".encode("utf-16"))
    assert table.form == ("UTF-16", "decimal commas")
    assert "Windows-1252" in read(tmp_path, "t,größe\n0,1\n".encode("cp1252")).form


def test_odd_lines_among_the_rows_are_left_out_and_said(tmp_path):
    rows = [f"{i},{i},{i}" for i in range(40)]
    rows[20] = "20,2"
    table = read(tmp_path, "\n".join(["t,p1,p2", *rows]))
    assert len(table.data) == 39
    assert "line 22" in table.form[-1]


def read_numbers(folder, content):
    table = read(folder, content)
    return table.numbers(table.names)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["holds no values"]),
        ("p1,p1\n1,2\n", ["p1"]),
        (",p1,,column 3 unnamed\n0,1,2,3\n", ["column 3"]),
        ("t,p1\n0,1\n0.01\n1,2\n1.0\n1,3\n", ["line 3", "1 other"]),
        ("Dear diary,\nnothing was measured.\n", ["without a table"]),
        ("t,p1\n0,1\n1,off\n", ["'off'", "p1", "line 3"]),
        ("t;p1\n0;0,5\n1;off\n", ["'off'", "p1", "line 3"]),
        ("t,p1\n0,1\n1," + "9" * 400 + "\n", ["p1", "line 3"]),
    ],
)
def test_what_is_no_table_is_one_sentence(tmp_path, content, words):
    with pytest.raises(InputError) as error:
        read_numbers(tmp_path, content)
    assert all(word in str(error.value) for word in ["a.csv", *words])


def test_a_long_text_is_held_once():
    rows = "\n".join(f"{i / 100:.2f}{',1234' * 12}" for i in range(20_000))
    lines = [f"t,{','.join(f's{i}' for i in range(1, 13))}", *rows.split("\n")]
    size = sum(map(len, lines))
    tracemalloc.start()
    table = table_of("a.csv", lines)
    _, highest = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert table.data.shape == (20_000, 13)
    assert highest < 8.0 * size


def test_a_column_that_holds_words_only_at_its_end_is_text(tmp_path):
    rows = "\n".join(f"{i},7" for i in range(300_000))
    table = read(tmp_path, f"t,object\n{rows}\n300000,cup\n")
    assert table.data["object"].iloc[[0, -1]].tolist() == ["7", "cup"]
    assert np.isfinite(table.numbers(["t"])).all()
