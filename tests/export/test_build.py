"""Nodes and constants of a graph, and the projection in both of its notations."""

import numpy as np
import onnx
import onnxruntime
import pytest
from onnx import TensorProto, helper

from export.build import OPSET, Builder, project, widened
from train.projection import Projection


class Names:
    """Names and initialisers, kept as skl2onnx's scope and container keep them."""

    def __init__(self):
        self.nodes, self.initial, self.count = [], [], 0

    def get_unique_variable_name(self, name):
        self.count += 1
        return f"{name}{self.count}"

    get_unique_operator_name = get_unique_variable_name

    def add_initializer(self, name, kind, shape, tensor):
        tensor.name = name
        self.initial.append(tensor)

    def add_node(self, operator, inputs, outputs, op_version=None, name=None, **attributes):
        self.nodes.append(helper.make_node(operator, inputs, outputs, name=name, **attributes))


@pytest.fixture
def graph():
    """A builder, and a function that runs what was built from x to the named output."""
    names = Names()

    def run(output, x):
        sides = [
            helper.make_tensor_value_info(n, TensorProto.DOUBLE, [None, None])
            for n in ("x", output)
        ]
        made = helper.make_graph(names.nodes, "g", sides[:1], sides[1:], names.initial)
        opset = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(made, opset_imports=opset, ir_version=8)
        onnx.checker.check_model(model)
        return onnxruntime.InferenceSession(model.SerializeToString()).run([output], {"x": x})[0]

    return Builder(names, names), names, run


def test_equal_constants_are_stored_once(graph):
    build, names, _ = graph
    assert build.constant(2.0) == build.constant(2.0)
    assert build.ints(1, 2) == build.ints(1, 2)
    assert len({build.constant(2.0), build.constant([2.0]), build.constant(2.0, np.float32)}) == 3
    assert build.constant(0.0) != build.constant(-0.0)
    assert len(names.initial) == 5 + 1


@pytest.mark.parametrize("scaling", ["none", "III"])
def test_the_graph_projects_to_the_bits_of_the_estimator(graph, scaling):
    build, _, run = graph
    X = np.random.default_rng(0).gamma(2.0, size=(30, 120)) * 10.0 ** np.arange(-3, 3).repeat(20)
    projection = Projection(scaling, 7).fit(X)
    np.testing.assert_array_equal(
        run(project(build, "x", [projection])[0], X), projection.transform(X)
    )


def test_widened_columns_are_zero():
    narrow, wide = widened([np.ones((2, 1)), np.ones((2, 3))])
    assert narrow.tolist() == [[1.0, 0.0, 0.0]] * 2
    assert wide.tolist() == [[1.0, 1.0, 1.0]] * 2
