"""Time, size and labels of a model in other number formats, on the committed golden
model."""

import json
from pathlib import Path

import numpy as np
import onnx
import pytest

from edge.demo import MODEL
from edge.errors import InputError
from export import arithmetic
from train.tradeoff.board import FORMAT, read_formats

GOLDEN = Path(__file__).parents[1] / "golden"


@pytest.fixture(params=["golden", "demo"])
def rows(monkeypatch, request):
    """Of a model without calibration, and of one that scores novelty."""
    monkeypatch.setattr(arithmetic, "CALLS", 2)
    monkeypatch.setattr(arithmetic, "ROUNDS", 1)
    if request.param == "demo":
        return arithmetic.compare(MODEL, GOLDEN / "demo.npz")
    return arithmetic.compare(GOLDEN / "model.onnx", GOLDEN / "golden.npz")


def test_each_format_has_its_price_and_the_shipped_one_no_other_label(rows):
    first = [row["format"].split()[0] for row in rows]
    assert first == ["whole", "float64,", "float32", "int8"]
    assert all(tuple(row) == FORMAT and row["decision us"] > 0.0 for row in rows)
    assert rows[0]["other labels %"] == rows[0]["other distances alone %"] == 0.0


@pytest.mark.parametrize(
    "file", ["golden/golden.npz", "../edge/demo/pillow-movable.npz"]
)
def test_a_golden_file_of_another_model_is_named(file):
    with pytest.raises(InputError, match=r"has no vectors of \d+ features"):
        arithmetic.compare(MODEL, GOLDEN.parent / file)


def test_labels_that_differ_are_counted(monkeypatch):
    """A copy that answers every second vector otherwise has half of the labels
    wrong."""
    monkeypatch.setattr(arithmetic, "in_int8", lambda model, folder: model)
    shipped = np.zeros((2, 8), np.int64)
    answers = iter([shipped, shipped, shipped + np.arange(8) % 2, shipped + 1])
    monkeypatch.setattr(arithmetic, "answers", lambda *_: (next(answers), 1.0, 0.0))

    rows = arithmetic.compare(GOLDEN / "model.onnx", GOLDEN / "golden.npz")

    assert [row["other labels %"] for row in rows] == [0.0, 0.0, 50.0, 100.0]


def test_the_copy_that_rounds_nothing_has_all_other_operators():
    shipped = onnx.load(GOLDEN / "model.onnx")
    copy = arithmetic.unrounded(shipped)

    onnx.checker.check_model(copy, full_check=True)
    before, after = ({n.op_type for n in m.graph.node} for m in (shipped, copy))
    assert before - {"Round"} == after


def test_the_copy_in_float32_has_no_float64_left():
    copy = arithmetic.in_float32(onnx.load(GOLDEN / "model.onnx"))

    kinds = {tensor.data_type for tensor in copy.graph.initializer}
    assert onnx.TensorProto.DOUBLE not in kinds
    onnx.checker.check_model(copy, full_check=True)


def test_what_the_program_writes_the_report_reads(tmp_path, monkeypatch, rows, capsys):
    monkeypatch.setattr(arithmetic, "compare", lambda *_: rows)
    path = tmp_path / "formats.json"

    assert arithmetic.main(["--model", "m", "--golden", "g", "--out", str(path)]) == 0
    assert read_formats(path) == json.loads(path.read_text()) == rows
    assert capsys.readouterr().out.count("\n") == 4
