"""Figures of machines and number formats, as the trade-off reads and shows them."""

from types import SimpleNamespace

import pytest

from edge.errors import InputError
from train.tradeoff import board, costs

ROW = {
    "format": "float32",
    "decision us": 20.0,
    "size kB": 10.0,
    "other labels %": 0.5,
    "other distances alone %": 2.0,
}


def test_number_formats_are_rows_beside_the_other_costs():
    table = costs.section(
        SimpleNamespace(y={"t": None}, costs=[], formats=[ROW])
    ).tables[0]

    (first,) = table.rows
    assert first["change"] == "float32"
    assert first["saves or costs"] == (
        "10 kB; 0.5 % of the labels differ; 2 % of the distances depend on the batch"
    )
    assert first[costs.TIME] == "20 us to decide"
    assert table.timed == (costs.TIME,)


@pytest.mark.parametrize("text", ["", "{}x", '[{"format": "int8"}]', "[3]"])
def test_a_damaged_file_of_formats_is_named(tmp_path, text):
    path = tmp_path / "formats.json"
    path.write_text(text)

    with pytest.raises(InputError, match=r"formats\.json.*export\.arithmetic"):
        board.read_formats(path)
