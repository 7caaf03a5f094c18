"""Text tables as people save them: separators, encodings, comments, packed files."""

import gzip
import lzma
import tracemalloc
import zipfile

import numpy as np
import pandas as pd
import pytest

from edge.errors import InputError
from train.importers import reading
from train.importers.reading import read_parquet, read_text
from train.importers.tables import numbers_of

PLAIN = "t,p1,p2\n0,1,2\n0.01,3,4\n"
ROWS = [[0.0, 1.0, 2.0], [0.01, 3.0, 4.0]]


def read(folder, content, name="a.csv"):
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_text(path)


def rows_of(table):
    return np.column_stack([numbers_of(table, n) for n in table.names]).tolist()


@pytest.mark.parametrize(
    "content",
    [
        PLAIN,
        PLAIN.replace("\n", "\r\n"),
        PLAIN.replace(",", "  "),
        "t;p1;p2\n0,0;1,0;2,0\n0,01;3,0;4,0\n",
        "sep=;\n" + PLAIN.replace(",", ";"),
        "\ufeff" + PLAIN,
        PLAIN.encode("utf-16"),
        "% 1.5\n\n# by me\n" + PLAIN,
        "# t,p1,p2\n0,1,2\n0.01,3,4\n",
        PLAIN.replace("\n0.01", "\n# a pause\n0.01"),
        PLAIN.replace("\n", "\n\n"),
    ],
)
def test_the_same_table_is_read_from_every_form(tmp_path, content):
    table = read(tmp_path, content)
    assert table.names == ["t", "p1", "p2"]
    assert rows_of(table) == ROWS


@pytest.mark.parametrize(
    ("name", "pack"),
    [
        ("a.csv.gz", gzip.compress),
        ("a.csv.xz", lzma.compress),
    ],
)
def test_packed_texts_are_unpacked(tmp_path, name, pack):
    assert rows_of(read(tmp_path, pack(PLAIN.encode()), name)) == ROWS


def test_a_zip_of_one_file_is_unpacked_and_one_of_several_refused(tmp_path):
    path = tmp_path / "a.csv.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.csv", PLAIN)
    assert rows_of(read_text(path)) == ROWS
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("b.csv", PLAIN)
    with pytest.raises(InputError, match="holds 2 files; unpack it into a folder"):
        read_text(path)


def test_what_unpacks_to_too_much_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(reading, "LARGEST_BYTES", 1 << 20)
    with pytest.raises(InputError, match="holds more than 1 MB"):
        read(tmp_path, gzip.compress(b"1" * (2 << 20)), "a.csv.gz")


def test_how_a_file_was_read_is_said(tmp_path):
    table = read(tmp_path, "zeit;p1\n0,0;1,5\n0,01;2,5\n".encode("utf-16"))
    assert table.form == ("UTF-16", "decimal commas")
    assert "Windows-1252" in read(tmp_path, "t,größe\n0,1\n".encode("cp1252")).form


def test_decimal_commas_may_begin_in_any_row(tmp_path):
    table = read(tmp_path, "t;p1\n0;1\n1;2\n2;3,5\n")
    assert rows_of(table) == [[0, 1], [1, 2], [2, 3.5]]


def test_a_column_that_only_a_comma_at_the_end_makes_is_no_column(tmp_path):
    assert read(tmp_path, "t,p1,\n0,1,\n1,2,\n").names == ["t", "p1"]
    unnamed = "t,Unnamed: 1,Unnamed: 2,p1\n0,,,1\n1,,7,2\n"
    assert read(tmp_path, unnamed).names == ["t", "column 3 unnamed", "p1"]
    assert rows_of(read(tmp_path, "t,p1\n0,1,\n1,2,\n")) == [[0, 1], [1, 2]]


def test_points_for_thousands_are_refused(tmp_path):
    path = tmp_path / "a.csv"
    rows = ["8.001;952", "8.002;1.027", "8.003;1.104", "8.004;998"]
    path.write_text("\n".join(["t;s", *rows]))
    assert read_text(path).data["s"].tolist() == [952, 1.027, 1.104, 998]
    path.write_text("\n".join(["t;s", *rows, "8.005;1.5"]))
    assert len(read_text(path).data) == 5
    path.write_text("\n".join(["t;s", *rows, "8.005;1.312"]))
    with pytest.raises(InputError, match=r"thousands, such as 1.027 beside 952; save"):
        read_text(path)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        ("", "holds no values"),
        ("t;p1\n0,5;1.234\n", "with a comma and with a point, such as 0,5 and 1.234"),
        ("p1,p1\n1,2\n", "two columns are named p1"),
        (",p1,,column 3 unnamed\n0,1,2,3\n", "two columns are named column 3"),
        ("t,p1\n0,1\n0.01\n", "line 3 has 1 value, and the first row 2"),
        ("# t\n\n1 2\n3\n", "line 4 has 1 value, and the first row 2"),
        (b"1 2\0\n", "it is not text"),
        ("1 " * (3 << 20), "has a line of 6 MB"),
    ],
)
def test_what_is_no_table_is_refused(tmp_path, content, sentence):
    with pytest.raises(InputError, match=sentence):
        read(tmp_path, content)


def test_lines_count_comments_blank_lines_and_lines_within_a_cell(tmp_path):
    table = read(tmp_path, '# me\n\nt,note,p1\n0,"a\nb",1\n\n# a pause\n1,c,off\n')
    assert table.data.index.tolist() == [5, 8]
    assert table.data.index.name == "line"


def test_the_index_of_a_parquet_table_is_a_column(tmp_path):
    pytest.importorskip("pyarrow")
    path = tmp_path / "a.parquet"
    pd.DataFrame(ROWS, columns=["t", "p1", "p2"]).set_index("t").to_parquet(path)
    assert rows_of(read_parquet(path)) == ROWS


def test_columns_without_a_name_are_told_apart_by_their_places(tmp_path):
    table = read(tmp_path, ",t,,p1,\n0,0,7,1,\n1,1,8,2,\n")
    assert table.names == ["column 1 unnamed", "t", "column 3 unnamed", "p1"]


def test_a_long_text_is_held_once():
    rows = "\n".join(f"{i / 100:.2f}{',1234' * 12}" for i in range(20_000))
    data = f"t,{','.join(f's{i}' for i in range(1, 13))}\n{rows}\n".encode()
    tracemalloc.start()
    try:
        text = reading._text(data)
        held, highest = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert len(text.numbers) == 20_001
    assert held < 1.5 * len(data)
    assert highest < 4.0 * len(data)


def test_a_column_that_holds_words_only_at_its_end_is_text(tmp_path):
    rows = "\n".join(f"{i},7" for i in range(300_000))
    table = read(tmp_path, f"t,object\n{rows}\n300000,cup\n")
    assert table.data["object"].iloc[[0, -1]].tolist() == ["7", "cup"]
