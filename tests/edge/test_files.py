"""Only regular files are read, and a parser's errors become sentences."""

import os

import pytest

from edge.errors import InputError
from edge.files import open_regular, parsing, read_bytes, read_text


def test_a_regular_file_is_read_and_one_that_is_no_text_is_named(tmp_path):
    (tmp_path / "a").write_bytes(b"\xc3\xa4")
    assert read_bytes(tmp_path / "a") == b"\xc3\xa4"
    assert read_text(tmp_path / "a") == "ä"
    (tmp_path / "a").write_bytes(b"\xff")
    with pytest.raises(InputError, match="a: not a text file: it is not UTF-8 text"):
        read_text(tmp_path / "a")


def test_what_is_no_regular_file_is_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "fifo")
    for path, why in (
        (tmp_path / "fifo", "not a regular file"),
        ("/dev/zero", "not a regular file"),
        (tmp_path, "Is a directory"),
        (tmp_path / "none", "No such file"),
        ("a\0b", "null"),
    ):
        with pytest.raises(InputError, match=f"cannot be read: .*{why}"):
            read_bytes(path)


def test_a_file_that_is_too_large_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "large").open("wb") as file:
        file.truncate(1 << 40)  # takes no room
    with (
        pytest.raises(
            InputError, match="1099511627776 bytes; a file of this kind has at most 100"
        ),
        open_regular(tmp_path / "large", 100),
    ):
        raise AssertionError


class Strange(BaseException):
    pass


@pytest.mark.parametrize(
    "error",
    [
        ValueError("bad"),
        KeyError("k"),
        OverflowError(),
        MemoryError(),
        RecursionError(),
    ],
)
def test_whatever_a_parser_raises_becomes_a_sentence(error):
    sentence = "^file: not a log: .+; log again$"
    with (
        pytest.raises(InputError, match=sentence),
        parsing("file", "a log", "; log again"),
    ):
        raise error


def test_an_interrupt_is_no_parsing_error():
    with pytest.raises(Strange), parsing("file", "a log"):
        raise Strange
