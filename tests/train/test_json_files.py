"""JSON files of the workstation: what is wrong with one is said in a sentence."""

import json

import pytest

from edge.errors import InputError
from train.json_files import json_file, read_json


def test_json_is_read_with_its_own_name_and_mend(tmp_path):
    path = tmp_path / "board.json"
    path.write_text(json.dumps({"a": 1}))
    assert read_json(path) == {"a": 1}
    with (
        pytest.raises(
            InputError, match=r"not a board file: 'stages' is missing; bench again"
        ),
        json_file(path, "a board file", "bench again") as found,
    ):
        found["stages"]
