"""Figures of machines and number formats, as the trade-off reads and shows them."""

from types import SimpleNamespace

import pytest

from edge.errors import InputError
from train.tradeoff import board, costs

ROW = {"format": "float32", "decision us": 20.0, "size kB": 10.0, "other labels %": 0.5}


def test_number_formats_are_a_table():
    (table,) = costs.formats(SimpleNamespace(formats=[ROW])).tables

    assert table.columns == list(board.FORMAT)
    assert table.cells == [["float32", 20.0, 10.0, 0.5]]
    assert table.timed == ("decision us",)


def test_without_number_formats_there_is_no_section():
    assert costs.formats(SimpleNamespace(formats=[])) is None


@pytest.mark.parametrize("text", ["", "{}x", '[{"format": "int8"}]', "[3]"])
def test_a_damaged_file_of_formats_is_named(tmp_path, text):
    path = tmp_path / "formats.json"
    path.write_text(text)

    with pytest.raises(InputError, match=r"formats\.json.*export\.arithmetic"):
        board.read_formats(path)
