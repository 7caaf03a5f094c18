"""Temporary files of dead runs are removed; those of living ones are not."""

import os
import time

from edge.files import check_writable, write_whole
from edge.leftovers import PREFIX, remove_leftovers

OLD = time.time() - 60.0


def left_by_a_dead_run(folder):
    path = folder / f"{PREFIX}0123456789abcdef"
    path.write_bytes(b"half of a file")
    os.utime(path, (OLD, OLD))
    return path


def test_what_a_dead_run_left_is_removed_before_a_run_writes(tmp_path):
    left = left_by_a_dead_run(tmp_path)
    (tmp_path / ".edge-classify-undo.json").write_text("[]")
    check_writable(tmp_path)
    assert not left.exists()
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
    left = left_by_a_dead_run(tmp_path)
    os.utime(left)
    remove_leftovers(tmp_path)
    assert left.exists()


def test_a_folder_that_is_missing_is_not_made(tmp_path):
    remove_leftovers(tmp_path / "none")
    assert list(tmp_path.iterdir()) == []
