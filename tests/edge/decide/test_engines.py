"""ONNX Runtime and numpy give the same bits; numpy steps in where the other is missing."""

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
from tests.conftest import ROOT, sealed

MODELS = [demo.MODEL, ROOT / "tests" / "golden" / "model.onnx"]


def assert_same_bits(path, vectors):
    """Both engines answer the same vectors alike; what is not finite has no label."""
    runtime = Model(path, "onnxruntime")
    graph = Model(path, "numpy")
    for point in range(len(runtime.decision_points_s)):
        for vector in vectors:
            expected = runtime.run(vector[None], point)
            answer = graph.run(vector[None], point)
            assert answer.keys() == expected.keys()
            for name in {"out_of_range", "novelty", "remoteness"} & expected.keys():
                assert answer[name].tobytes() == expected[name].tobytes()
            for task in runtime.info.tasks:
                assert_same_answer(task, answer, expected)


def assert_same_answer(task, answer, expected):
    label = expected[f"{task}_label"]
    assert answer[f"{task}_label"] == label
    for name, value in expected.items():
        if name.startswith(f"{task}_") and label >= 0:
            assert answer[name].dtype == value.dtype
            assert answer[name].shape == value.shape
            assert answer[name].tobytes() == value.tobytes()


def hostile(width, rng):
    """Vectors of every kind: plain, far, equal, not finite."""
    plain = rng.normal(size=(6, width))
    far = 10.0 ** rng.uniform(0, 14, (6, 1)) * rng.normal(size=(6, width))
    odd = np.zeros((4, width))
    odd[1] = np.nan
    odd[2, 0] = np.inf
    odd[3] = 1e308
    return np.concatenate([plain, far, odd])


def test_names_of_a_file_reach_no_terminal_through_a_log(tmp_path, capfd):
    """An index that is past its table only when the graph runs."""
    proto = onnx.load(demo.MODEL)
    for number, node in enumerate(proto.graph.node):
        node.name = f"\x1b[2J{number}"
    (labels,) = [t for t in proto.graph.initializer if t.name == "labels of object"]
    far = numpy_helper.to_array(labels) + 500
    labels.CopyFrom(numpy_helper.from_array(far.astype(np.int64), labels.name))
    path = tmp_path / "model.onnx"
    path.write_bytes(sealed(proto))
    model = Model(path, "onnxruntime")
    with pytest.raises(InputError) as refused:
        model.decide(np.zeros(model.info.width))
    output = str(refused.value), *capfd.readouterr()
    assert "\x1b" not in "".join(output)


@pytest.mark.parametrize("path", MODELS)
def test_the_models_of_the_checkout_have_the_same_bits_in_both(path):
    golden = path.with_name("golden.npz")
    rng = np.random.default_rng(1)
    vectors = hostile(Model(path).info.width, rng)
    if golden.exists():
        vectors = np.concatenate([vectors, np.load(golden)["vectors"]])
    assert_same_bits(path, vectors)


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
