"""Files are written whole or not at all; temporary files of dead runs are removed."""

import os
import time

import pytest

from edge.errors import InputError
from edge.writing import (
    PREFIX,
    NameTaken,
    check_writable,
    remove_leftovers,
    write_whole,
)

OLD = time.time() - 60.0


def left_by_a_dead_run(folder):
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{PREFIX}0123456789abcdef"
    path.write_bytes(b"half of a file")
    os.utime(path, (OLD, OLD))
    return path


def test_what_a_dead_run_left_is_removed_before_a_run_writes(tmp_path):
    leftover = left_by_a_dead_run(tmp_path)
    (tmp_path / ".edge-classify-undo.json").write_text("[]")
    check_writable(tmp_path)
    assert not leftover.exists()
    assert [path.name for path in tmp_path.iterdir()] == [".edge-classify-undo.json"]


def test_a_file_that_is_being_written_stays(tmp_path):
    with write_whole(tmp_path / "a") as file:
        file.write(b"x")
        (temporary,) = tmp_path.iterdir()
        os.utime(temporary, (OLD, OLD))
        remove_leftovers(tmp_path)
    assert (tmp_path / "a").read_bytes() == b"x"
    assert len(list(tmp_path.iterdir())) == 1


def test_a_young_file_stays_as_it_may_not_be_locked_yet(tmp_path):
    leftover = left_by_a_dead_run(tmp_path)
    os.utime(leftover)
    remove_leftovers(tmp_path)
    assert leftover.exists()


@pytest.fixture
def path(tmp_path):
    return tmp_path / "a"


def test_a_file_is_whole_or_as_it_was(path, tmp_path):
    path.write_text("before")
    with pytest.raises(ZeroDivisionError), write_whole(path) as file:  # noqa: PT012
        file.write(b"half")
        raise ZeroDivisionError
    assert path.read_text() == "before"
    assert os.listdir(tmp_path) == ["a"]
    with write_whole(path) as file:
        file.write(b"after")
    assert path.read_text() == "after"
    assert os.listdir(tmp_path) == ["a"]


def test_a_name_that_another_process_takes_first_stays_as_it_is(path, tmp_path):
    with (  # noqa: PT012 - the file is taken while it is being written
        pytest.raises(NameTaken, match="exists already"),
        write_whole(path, overwrite=False) as f,
    ):
        f.write(b"mine")
        path.write_text("theirs")
    assert path.read_text() == "theirs"
    assert os.listdir(tmp_path) == ["a"]


def test_where_there_are_no_hard_links_a_file_is_still_whole_and_overwrites_none(
    path,
    tmp_path,
    monkeypatch,
):
    def refused(*_):
        raise PermissionError(1, "Operation not permitted")  # what FAT answers

    monkeypatch.setattr(os, "link", refused)
    with write_whole(path, overwrite=False) as file:
        file.write(b"first")
    with pytest.raises(NameTaken), write_whole(path, overwrite=False) as file:
        file.write(b"second")
    assert path.read_bytes() == b"first"
    assert os.listdir(tmp_path) == ["a"]


def test_what_is_written_is_on_the_disk_before_it_has_its_name(path, monkeypatch):
    order = []
    fsync = os.fsync
    replace = os.replace
    monkeypatch.setattr(os, "fsync", lambda fd: order.append("fsync") or fsync(fd))
    monkeypatch.setattr(os, "replace", lambda *a: order.append("name") or replace(*a))
    with write_whole(path) as file:
        file.write(b"x")
    assert order == ["fsync", "name", "fsync"]
    order.clear()
    with write_whole(path, lasting=False) as file:
        file.write(b"y")
    assert order == ["name"]
    assert path.read_bytes() == b"y"


def test_the_longest_name_can_be_written(tmp_path):
    longest = tmp_path / ("a" * 255)
    with write_whole(longest) as file:
        file.write(b"x")
    assert longest.read_bytes() == b"x"


def test_a_file_has_the_rights_that_the_user_gives_to_new_ones(tmp_path):
    before = os.umask(0o027)
    try:
        with write_whole(tmp_path / "new" / "a") as file:
            file.write(b"x")
    finally:
        os.umask(before)
    assert (tmp_path / "new" / "a").stat().st_mode & 0o777 == 0o640


def test_a_folder_that_cannot_be_written_is_known_beforehand(tmp_path):
    (tmp_path / "file").write_text("")
    check_writable(tmp_path / "new" / "folder")
    reasons = {
        tmp_path / "file": "it is no folder",
        tmp_path / "file" / "folder": "Not a directory",
        "a\0b": "embedded null byte",
    }
    for folder, reason in {**reasons, "/proc/none": "No such file"}.items():
        with pytest.raises(InputError, match=f"cannot be written: {reason}"):
            check_writable(folder)


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("fifo", "it is not a regular file"),
        ("folder", "it is not"),
        ("a\0b", "a null character"),
        ("a\0b/c", "a null character"),
    ],
)
def test_what_is_no_regular_file_is_not_replaced_by_one(tmp_path, name, why):
    os.mkfifo(tmp_path / "fifo")
    (tmp_path / "folder").mkdir()
    before = [path.stat() for path in tmp_path.iterdir()]
    with pytest.raises(InputError, match=why), write_whole(tmp_path / name):
        raise AssertionError
    assert [path.stat() for path in tmp_path.iterdir()] == before
