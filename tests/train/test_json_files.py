"""JSON files of the workstation: what is wrong with one is said in a sentence."""

import pytest

from edge.errors import InputError
from train.json_files import json_file, json_table


def test_a_table_is_read_and_empty_where_there_is_no_file(tmp_path):
    path = tmp_path / "board.json"
    assert json_table(path).raw == {}
    path.write_text('{"a": 1}')
    assert json_table(path).raw == {"a": 1}


def test_what_a_block_misses_is_said_with_the_kind_of_file_and_the_remedy(tmp_path):
    path = tmp_path / "board.json"
    path.write_text("{}")
    with (
        pytest.raises(InputError, match="'stages' is missing; bench again"),
        json_file(path, "a board file", "bench again") as board,
    ):
        board["stages"]
