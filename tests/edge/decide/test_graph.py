"""The graph in numpy: each operator by its definition in ONNX, and single values by name."""

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from edge import demo
from edge.decide import onnx_file
from edge.decide.graph import OPERATORS, Graph
from edge.errors import InputError

X = np.array([[3.0, -1.0, 2.0], [0.0, 2.5, -0.5]])
CASES = {
    "Add": ([X, X], {}, X + X),
    "ArgMax": ([X], {"axis": 1, "keepdims": 0}, [0, 1]),
    "Cast": ([X], {"to": TensorProto.INT64}, [[3, -1, 2], [0, 2, 0]]),
    "Clip": ([X, np.array(-0.5), np.array(2.0)], {}, [[2, -0.5, 2], [0, 2, -0.5]]),
    "Div": ([X, np.array(4.0)], {}, X / 4.0),
    "Gather": ([X, np.array([2, -3])], {"axis": 1}, [[2, 3], [-0.5, 0]]),
    "GatherElements": ([X, np.array([[2], [0]])], {"axis": 1}, [[2], [0]]),
    "GatherND": ([X, np.array([[[1]], [[2]]])], {"batch_dims": 1}, [[-1], [-0.5]]),
    "Gemm": ([X, X.T, np.array([1.0, np.inf])], {}, [[15, np.inf], [-2.5, np.inf]]),
    "LessOrEqual": ([X, np.array(0.0)], {}, X <= 0.0),
    "MatMul": ([X, X.T], {}, [[14, -3.5], [-3.5, 6.5]]),
    "Max": ([X, -X, np.array(1.0)], {}, [[3, 1, 2], [1, 2.5, 1]]),
    "Mul": ([X, X], {}, X * X),
    "Pad": (
        [X, np.array([0, 1, 0, 0]), np.array(7.0)],
        {},
        [[7, 3, -1, 2], [7, 0, 2.5, -0.5]],
    ),
    "ReduceL1": ([X, np.array([1])], {"keepdims": 1}, [[6], [3]]),
    "ReduceMean": ([X[:, 1:], np.array([1])], {"keepdims": 0}, [0.5, 1]),
    "ReduceSum": ([X, np.array([1])], {"keepdims": 0}, [4, 2]),
    "ReduceSumSquare": ([X, np.array([1])], {"keepdims": 1}, [[14], [6.5]]),
    "Round": ([X], {}, [[3, -1, 2], [0, 2, 0]]),
    "Sqrt": ([np.array([4.0, 2.0])], {}, [2, 2**0.5]),
    "Squeeze": ([X[:1], np.array([0])], {}, X[0]),
    "Sub": ([X, X[1]], {}, X - X[1]),
    "Where": ([X > 0.0, X, np.array(-9.0)], {}, [[3, -9, 2], [-9, 2.5, -9]]),
}


def one_node(operator, arrays, attributes, outputs=("y",)):
    """The graph of a single node, whose inputs are constants."""
    names = [f"x{i}" for i in range(len(arrays))]
    node = helper.make_node(operator, names, outputs, **attributes)
    constants = map(numpy_helper.from_array, map(np.asarray, arrays), names)
    values = [helper.make_empty_tensor_value_info(name) for name in outputs]
    graph = helper.make_graph([node], "g", [], values, list(constants))
    opset = [helper.make_opsetid("", 18)]
    proto = helper.make_model(graph, opset_imports=opset, ir_version=8)
    return onnx_file.read(proto.SerializeToString(), "one node")


@pytest.mark.parametrize("operator", CASES)
def test_an_operator_gives_the_values_of_its_definition(operator):
    arrays, attributes, expected = CASES[operator]
    [value] = Graph(one_node(operator, arrays, attributes)).run(["y"], {})
    np.testing.assert_array_equal(value, expected)


def test_of_equal_values_the_first_is_nearest():
    x = np.array([[2.0, 1.0, 2.0, 1.0, 0.0]])
    contents = one_node(
        "TopK",
        [x, np.array([4])],
        {"largest": 0, "sorted": 1},
        ("values", "places"),
    )
    values, places = Graph(contents).run(["values", "places"], {})
    assert values.tolist() == [[0.0, 1.0, 1.0, 2.0]]
    assert places.tolist() == [[4, 1, 3, 0]]


def test_the_largest_values_come_first_where_asked_for():
    contents = one_node("TopK", [X, np.array([2])], {"axis": 1}, ("values", "places"))
    [values] = Graph(contents).run(["values"], {})
    assert values.tolist() == [[3.0, 2.0], [2.5, 0.0]]


def test_every_operator_of_an_exported_model_is_tried():
    assert OPERATORS.keys() == onnx_file.OPERATORS
    assert {*CASES, "TopK"} == OPERATORS.keys()


@pytest.fixture
def graph():
    return Graph(onnx_file.read(demo.MODEL.read_bytes(), "the demo"))


def test_a_value_that_the_graph_lacks_and_a_shape_that_does_not_fit_are_named(graph):
    with pytest.raises(InputError, match="cannot be computed .KeyError: 'nothing'"):
        graph.run(["nothing"], {})
    with pytest.raises(InputError, match="cannot be computed .ValueError"):
        graph.run(["mobility_label"], {"features": np.zeros((1, 7))})


def test_negative_attributes_are_read():
    contents = one_node("ArgMax", [X], {"axis": -1})
    assert contents.nodes[0].attributes == {"axis": -1}
