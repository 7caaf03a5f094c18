"""A model file is refused before ONNX Runtime sees it where no exported model looks like it."""

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from edge.errors import InputError
from edge.model import onnx_file


def check(data, name):
    contents = onnx_file.read(data, name)
    onnx_file.check(contents, name)
    return contents


def model(nodes, initial=(), **more):
    """The bytes of a graph x -> y of these nodes."""
    sides = [helper.make_tensor_value_info(n, TensorProto.DOUBLE, [None, 2]) for n in ("x", "y")]
    graph = helper.make_graph(nodes, "g", sides[:1], sides[1:], list(initial))
    proto = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], **more)
    helper.set_model_props(proto, {"kind": "a test", "umlaut": "ä"})
    return proto


def add(name="Add", **attributes):
    return helper.make_node(name, ["x", "x"], ["y"], **attributes)


@pytest.mark.parametrize(
    ("node", "named"),
    [
        (add("Loop"), "operator Loop"),
        (add("Add", domain="com.evil"), "operator com.evil.Add"),
        (add("CDist", domain="com.microsoft"), "operator com.microsoft.CDist"),
    ],
)
def test_an_operator_of_no_exported_model_is_named(node, named):
    with pytest.raises(InputError, match=f"m.onnx: has {named}, as no exported model has"):
        check(model([node]).SerializeToString(), "m.onnx")


def a_function():
    own = helper.make_function("own", "F", ["a"], ["b"], [helper.make_node("Sqrt", ["a"], ["b"])],
                               [helper.make_opsetid("", 18)])  # fmt: skip
    return model([add()], functions=[own])


def an_inner_graph():
    inner = model([add()]).graph
    return model([helper.make_node("Add", ["x", "x"], ["y"], then_branch=inner)])


def a_tensor_in_an_attribute():
    tensor = numpy_helper.from_array(np.ones(2), "w")
    return model([helper.make_node("Add", ["x", "x"], ["y"], value=tensor)])


def a_sparse_constant():
    proto = model([add()])
    values, place = numpy_helper.from_array(np.ones(1), "w"), np.zeros(1, dtype=np.int64)
    sparse = helper.make_sparse_tensor(values, numpy_helper.from_array(place), [1 << 40])
    proto.graph.sparse_initializer.append(sparse)
    return proto


@pytest.mark.parametrize(
    "made", [a_function, an_inner_graph, a_tensor_in_an_attribute, a_sparse_constant]
)
def test_parts_that_no_exported_model_has_are_refused(made):
    with pytest.raises(InputError, match="functions, inner graphs or sparse tensors"):
        check(made().SerializeToString(), "m")


def test_more_nodes_than_any_exported_model_has_are_refused():
    data = model([add()] * (onnx_file.MOST_NODES + 1)).SerializeToString()
    with pytest.raises(InputError, match="has 1001 nodes"):
        check(data, "m")


@pytest.mark.parametrize("told", [True, False], ids=["told", "path alone"])
def test_weights_in_another_file_are_refused(told):
    tensor = numpy_helper.from_array(np.ones(2), "w")
    tensor.external_data.add(key="location", value="/etc/passwd")
    if told:
        tensor.data_location = TensorProto.EXTERNAL
    tensor.ClearField("raw_data")
    with pytest.raises(InputError, match="weights lie in another file"):
        check(model([add()], [tensor]).SerializeToString(), "m")
