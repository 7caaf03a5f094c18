"""JSON files of the workstation: what is wrong with one is said in a sentence."""

import pytest

from edge.errors import InputError
from train.json_files import json_file, json_table


def test_a_table_is_read(tmp_path):
    (tmp_path / "board.json").write_text('{"a": 1}')
    assert json_table(tmp_path / "board.json").raw == {"a": 1}


def test_a_file_that_is_not_there_is_an_empty_table(tmp_path):
    assert json_table(tmp_path / "board.json").raw == {}


def test_what_a_block_misses_is_said_with_the_kind_of_file_and_the_remedy(tmp_path):
    path = tmp_path / "board.json"
    path.write_text("{}")
    sentence = r"board.json: not a board file: 'stages' is missing; bench again"
    with (
        pytest.raises(InputError, match=sentence),
        json_file(path, "a board file", "bench again") as board,
    ):
        board["stages"]
