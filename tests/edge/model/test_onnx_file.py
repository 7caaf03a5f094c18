"""A model file is refused before ONNX Runtime sees it where no exported model looks like it."""

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from edge.errors import InputError
from edge.model import onnx_file


def model(nodes, initial=(), **more):
    """The bytes of a graph x -> y of these nodes."""
    sides = [helper.make_tensor_value_info(n, TensorProto.DOUBLE, [None, 2]) for n in ("x", "y")]
    graph = helper.make_graph(nodes, "g", sides[:1], sides[1:], list(initial))
    proto = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], **more)
    helper.set_model_props(proto, {"kind": "a test", "umlaut": "ä"})
    return proto


def add(name="Add", **attributes):
    return helper.make_node(name, ["x", "x"], ["y"], **attributes)


def test_metadata_is_what_onnx_reads(exported):
    data = (exported / "model.onnx").read_bytes()
    told = {prop.key: prop.value for prop in onnx.load_from_string(data).metadata_props}
    assert onnx_file.check(data, "model").metadata == told
    assert onnx_file.check(model([add()]).SerializeToString(), "m").metadata["umlaut"] == "ä"


@pytest.mark.parametrize(
    ("node", "named"),
    [
        (add("Loop"), "operator Loop"),
        (add("Add", domain="com.evil"), "operator com.evil.Add"),
        (add("CDist", domain="com.microsoft"), "operator com.microsoft.CDist"),
    ],
)
def test_an_operator_of_no_exported_model_is_named(node, named):
    with pytest.raises(InputError, match=f"m.onnx: has {named}, which no exported model uses"):
        onnx_file.check(model([node]).SerializeToString(), "m.onnx")


def test_an_operator_within_a_branch_is_seen():
    inner = helper.make_graph([helper.make_node("Exp", ["x"], ["z"])], "b", [], [
        helper.make_tensor_value_info("z", TensorProto.DOUBLE, None)])  # fmt: skip
    choice = helper.make_node("If", ["x"], ["y"], then_branch=inner, else_branch=inner)
    with pytest.raises(InputError, match="operator Exp"):
        onnx_file.check(model([choice]).SerializeToString(), "m")


def test_functions_of_its_own_are_refused():
    own = helper.make_function("own", "F", ["a"], ["b"], [helper.make_node("Sqrt", ["a"], ["b"])],
                               [helper.make_opsetid("", 18)])  # fmt: skip
    with pytest.raises(InputError, match="functions of its own"):
        onnx_file.check(model([add()], functions=[own]).SerializeToString(), "m")


@pytest.mark.parametrize("where", ["initializer", "attribute"])
def test_weights_in_another_file_are_refused(where):
    tensor = numpy_helper.from_array(np.ones(2), "w")
    tensor.data_location = TensorProto.EXTERNAL
    tensor.external_data.add(key="location", value="/etc/passwd")
    tensor.ClearField("raw_data")
    if where == "initializer":
        data = model([add()], [tensor])
    else:
        data = model([helper.make_node("Constant", [], ["y"], value=tensor)])
    with pytest.raises(InputError, match="weights lie in another file"):
        onnx_file.check(data.SerializeToString(), "m")


def test_a_file_cut_anywhere_is_a_model_or_one_sentence():
    data = model([add()], [numpy_helper.from_array(np.arange(3.0), "w")]).SerializeToString()
    refused = 0
    for length in range(len(data)):
        try:
            onnx_file.check(data[:length], "cut.onnx")
        except InputError as error:
            refused += 1
            assert str(error).startswith("cut.onnx: ")
    assert refused > 0.9 * len(data)
