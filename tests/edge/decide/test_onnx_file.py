"""A model file is refused before ONNX Runtime sees it where no exported model looks
like it."""

import numpy as np
import pytest
from onnx import TensorProto, helper, numpy_helper

from edge.decide import onnx_file
from edge.errors import InputError
from tests.conftest import sealed


def check(proto):
    """The contents of a model that was sealed after its changes."""
    name = "m.onnx"
    contents = onnx_file.read(sealed(proto), name)
    onnx_file.check(contents, name)
    return contents


def model(nodes, initial=(), opset=onnx_file.OPSET, **more):
    """The bytes of a graph features -> y of these nodes."""
    sides = [
        helper.make_tensor_value_info(n, TensorProto.DOUBLE, [None, 2])
        for n in ("features", "y")
    ]
    graph = helper.make_graph(nodes, "g", sides[:1], sides[1:], list(initial))
    imports = [helper.make_opsetid("", opset)]
    return helper.make_model(graph, opset_imports=imports, **more)


def add(name="Add", **attributes):
    return helper.make_node(name, ["features", "features"], ["y"], **attributes)


def a_function():
    function = helper.make_function(
        "own",
        "F",
        ["a"],
        ["b"],
        [helper.make_node("Sqrt", ["a"], ["b"])],
        [helper.make_opsetid("", 18)],
    )
    return model([add()], functions=[function])


def a_sparse_constant():
    proto = model([add()])
    values, places = (
        numpy_helper.from_array(a, "w") for a in (np.ones(1), np.zeros(1, np.int64))
    )
    sparse = helper.make_sparse_tensor(values, places, [1 << 40])
    proto.graph.sparse_initializer.append(sparse)
    return proto


def weights_elsewhere(**fields):
    tensor = numpy_helper.from_array(np.ones(2), "w")
    tensor.external_data.add(key="location", value="/etc/passwd")
    tensor.MergeFrom(TensorProto(**fields))
    tensor.ClearField("raw_data")
    return model([add()], [tensor])


TENSOR = numpy_helper.from_array(np.ones(2), "w")
SPARSE = a_sparse_constant().graph.sparse_initializer[0]
TYPE = helper.make_tensor_type_proto(TensorProto.DOUBLE, [1])
PARTS = "functions, inner graphs or sparse tensors, as no exported model has"
REFUSED = {
    "many nodes": (model([add()] * (onnx_file.MOST_NODES + 1)), "1001 nodes"),
    "a loop": (model([add("Loop")]), "operator Loop, as no"),
    "a foreign domain": (
        model([add(domain="com.evil")]),
        "operator com.evil.Add, as no",
    ),
    "a function": (a_function(), PARTS),
    "an inner graph": (model([add(then_branch=model([add()]).graph, times=2)]), PARTS),
    "a tensor in an attribute": (model([add(value=TENSOR)]), PARTS),
    "tensors": (model([add(value=[TENSOR, TENSOR])]), PARTS),
    "a sparse tensor": (model([add(value=SPARSE)]), PARTS),
    "a type": (model([add(value=TYPE)]), PARTS),
    "a sparse constant": (a_sparse_constant(), PARTS),
    "weights elsewhere": (
        weights_elsewhere(data_location=TensorProto.EXTERNAL),
        "weights in another file, as no",
    ),
    "older operators": (
        model([add()], opset=7),
        "operators of another version than 18",
    ),
    "newer operators": (
        model([add()], opset=99),
        "operators of another version than 18",
    ),
    "a path alone": (weights_elsewhere(), "weights in another file, as no"),
}


@pytest.mark.parametrize(("proto", "sentence"), REFUSED.values(), ids=REFUSED)
def test_what_no_exported_model_has_is_refused(proto, sentence):
    with pytest.raises(InputError, match=rf"^m.onnx: has {sentence}"):
        check(proto)


@pytest.mark.parametrize("value", [0.5, "text", [1, 2]], ids=str)
def test_an_attribute_may_be_numbers_or_a_text(value):
    contents = check(model([add(own=value)]))
    assert contents.foreign == []
    assert contents.nodes == 1


@pytest.mark.parametrize("data", ["38 05", "3a 04 0a 02 20 05"])
def test_a_number_where_bytes_belong_is_no_model(data):
    """A graph, a node and the name of an operator that are the number 5."""
    with pytest.raises(
        InputError, match=r"^m.onnx: not an ONNX model; copy or export it again"
    ):
        onnx_file.read(bytes.fromhex(data), "m.onnx")


def test_any_damaged_byte_of_the_digest_is_damage():
    data = sealed(model([add()]))
    for place in range(1, onnx_file.DIGITS + len(onnx_file.DIGEST) + 1):
        for byte in (b"_", b"z", b"\0"):
            damaged = data[:-place] + byte + data[len(data) - place + 1 :]
            with pytest.raises(InputError):
                onnx_file.check(onnx_file.read(damaged, "m.onnx"), "m.onnx")
