"""Numpy steps in where ONNX Runtime is missing, and no text of a file reaches a terminal."""

import logging
import sys

import numpy as np
import onnx
import pytest
from onnx import numpy_helper

import edge as edge_package
from edge import demo
from edge.decide.model import Model
from edge.errors import EdgeError, InputError
from tests.conftest import sealed


def test_names_of_a_file_reach_no_terminal_through_a_log(tmp_path, capfd):
    """An index that is past its table once the graph runs."""
    proto = onnx.load(demo.MODEL)
    for number, node in enumerate(proto.graph.node):
        node.name = f"\x1b[2J{number}"
    (labels,) = [t for t in proto.graph.initializer if t.name == "labels of object"]
    far = numpy_helper.to_array(labels) + 500
    labels.CopyFrom(numpy_helper.from_array(far.astype(np.int64), labels.name))
    path = tmp_path / "model.onnx"
    path.write_bytes(sealed(proto))
    with pytest.raises(InputError) as refused:
        Model(path, "onnxruntime")
    output = str(refused.value), *capfd.readouterr()
    assert "\x1b" not in "".join(output)


def without_onnxruntime(monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)


def test_numpy_steps_in_where_onnxruntime_is_missing_and_says_so(monkeypatch, caplog):
    expected = Model(demo.MODEL).decide(np.zeros(120))
    without_onnxruntime(monkeypatch)
    with caplog.at_level(logging.WARNING, "edge.decide"):
        model = edge_package.Model(demo.MODEL)
    assert model.engine == "numpy"
    assert "numpy runs the model, with the same bits" in caplog.text
    decided = model.decide(np.zeros(120))
    assert decided.keys() == expected.keys()
    for task, decision in decided.items():
        assert decision.label == expected[task].label
        assert decision.distances.tobytes() == expected[task].distances.tobytes()


def test_an_engine_that_is_asked_for_must_be_there(monkeypatch):
    without_onnxruntime(monkeypatch)
    with pytest.raises(EdgeError, match="onnxruntime cannot be imported"):
        Model(demo.MODEL, "onnxruntime")
    with pytest.raises(InputError, match="no engine 'tea'; give onnxruntime or numpy"):
        Model(demo.MODEL, "tea")


def test_run_takes_the_engine_that_is_asked_for(edge, monkeypatch, caplog):
    """Numpy is then no stopgap, of which it would warn."""
    without_onnxruntime(monkeypatch)
    touch = ("--fake", demo.FOLDER / "pillow-movable.npz", "--seconds", 2)
    status, events, _ = edge("run", "--model", demo.MODEL, *touch, "--engine", "numpy")
    assert status == 0
    assert [e["label"] for e in events if e["event"] == "decision"][-1] == "pillow"
    assert "numpy runs the model" not in caplog.text


def test_a_constant_that_numpy_misses_is_refused_when_the_model_is_loaded(tmp_path):
    proto = onnx.load(demo.MODEL)
    for tensor in proto.graph.initializer:
        tensor.name = tensor.name.replace("scales of", "scale of")
    path = tmp_path / "model.onnx"
    path.write_bytes(sealed(proto))
    with pytest.raises(InputError, match="KeyError: .*_label_distances"):
        Model(path, "numpy")
