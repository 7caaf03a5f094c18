"""A model file is refused before ONNX Runtime sees it where no exported model looks like it."""

from itertools import pairwise

import numpy as np
import onnx
import onnxruntime
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


def shapes(data):
    """{value: its shape as the work is reckoned}, at one vector."""
    work = onnx_file._Work(1 << 40)
    [graph] = map(onnx_file._message, onnx_file.read(data).graphs)
    work.graph(graph)
    return work._shapes


def test_shapes_are_no_smaller_than_those_that_onnx_runtime_makes(exported):
    proto = onnx.load(exported / "model.onnx")
    made = [name for node in proto.graph.node for name in node.output]
    given = np.zeros((1, proto.graph.input[0].type.tensor_type.shape.dim[1].dim_value))
    reckoned = shapes(proto.SerializeToString())
    del proto.graph.output[:]
    proto.graph.output.extend(helper.make_empty_tensor_value_info(name) for name in made)
    session = onnxruntime.InferenceSession(
        proto.SerializeToString(), providers=["CPUExecutionProvider"]
    )
    real = session.run(made, {"features": given})
    for name, value in zip(made, real, strict=True):
        assert len(value.shape) == len(reckoned[name])
        assert all(a <= b for a, b in zip(value.shape, reckoned[name], strict=True)), name


def node(operator, *inputs, **attributes):
    return helper.make_node(operator, ["x", *inputs], ["y"], **attributes)


WHOLE = {
    "one": [1],
    "both": [0, 1],
    "margins": [0, 2, 0, 3],
    "margin": [2, 3],
    "k": [2],
    "cells": [[0, 1], [2, 3], [1, 1], [0, 0]],
    "rows": [[0], [2], [1], [0]],
}


@pytest.mark.parametrize(
    ("made", "shape"),
    [
        (node("ReduceSum", "one"), (3, 1)),
        (node("ReduceSum", "one", keepdims=0), (3,)),
        (node("ReduceMin", keepdims=0), ()),
        (node("ArgMax", axis=1, keepdims=0), (3,)),
        (node("Unsqueeze", "both"), (1, 1, 3, 5)),
        (node("Gather", "both", axis=1), (3, 2)),
        (node("GatherND", "cells"), (4,)),
        (node("GatherND", "rows"), (4, 5)),
        (node("Concat", "x", axis=-1), (3, 10)),
        (node("Pad", "margins"), (3, 10)),
        (node("Pad", "margin", "", "one"), (3, 10)),
        (node("MatMul", "wide"), (3, 7)),
        (node("Where", "x", "x", "deep"), (2, 3, 5)),
        (node("TopK", "k"), (3, 2)),
    ],
    ids=lambda value: (
        "-".join([value.op_type, *value.input[1:]]) if hasattr(value, "input") else ""
    ),
)
def test_shapes_of_each_operator(made, shape):
    """Those of ONNX's own inference; of TopK no more than its input's is known."""
    if made.op_type == "TopK":
        made.output.append("places")
    if made.op_type == "Where":
        made.input[:] = ["yes", "x", "deep"]
    sides = [
        helper.make_tensor_value_info("x", TensorProto.DOUBLE, [3, 5]),
        helper.make_empty_tensor_value_info("y"),
    ]
    constants = [numpy_helper.from_array(np.array(v), name) for name, v in WHOLE.items()]
    constants.append(numpy_helper.from_array(np.zeros((5, 7)), "wide"))
    constants.append(numpy_helper.from_array(np.zeros((2, 1, 1)), "deep"))
    constants.append(numpy_helper.from_array(np.zeros(5, dtype=bool), "yes"))
    graph = helper.make_graph([made], "g", sides[:1], sides[1:], constants)
    proto = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)])
    told = onnx.shape_inference.infer_shapes(proto, strict_mode=True, data_prop=True)
    assert tuple(d.dim_value for d in told.graph.output[0].type.tensor_type.shape.dim) == shape
    reckoned = shapes(proto.SerializeToString())["y"]
    assert reckoned == ((3, 5) if made.op_type == "TopK" else shape)


def test_the_shape_of_a_choice_is_that_of_its_larger_branch():
    branches = [
        helper.make_graph(
            [helper.make_node("Concat", ["x"] * n, ["z"], axis=0)],
            "b",
            [],
            [helper.make_empty_tensor_value_info("z")],
        )
        for n in (1, 3)
    ]
    choice = node("If", then_branch=branches[0], else_branch=branches[1])
    assert shapes(model([choice]).SerializeToString())["y"] == (3, 2)


def doubled(times):
    names = ["x", *(f"v{i}" for i in range(times - 1)), "y"]
    return [helper.make_node("Concat", [a, a], [b], axis=1) for a, b in pairwise(names)]


COLUMN = numpy_helper.from_array(np.zeros((5000, 1)), "w")
FAR = numpy_helper.from_array(np.array([0, 0, 0, 1 << 40]), "w")
AXES = numpy_helper.from_array(np.array([0]), "w")


@pytest.mark.parametrize(
    ("nodes", "constant"),
    [
        (doubled(60), COLUMN),
        (
            [
                helper.make_node("Add", ["x", "w"], ["a"]),
                helper.make_node("Gather", ["a", "i"], ["b"], axis=1),
                helper.make_node("MatMul", ["a", "b"], ["y"]),
            ],
            COLUMN,
        ),
        ([node("Pad", "w")], FAR),
        ([helper.make_node("Cast", ["x"], ["w2"], to=7), node("Unsqueeze", "w2")], AXES),
        ([node("ReduceSum", "w", keepdims=0, noop_with_empty_axes=1)], AXES),
        ([helper.make_node("Sqrt", ["nowhere"], ["y"])], AXES),
        ([node("Add", "x")] * 70_000, AXES),
    ],
    ids=["doubling", "product", "margin", "made axes", "no axes", "unknown name", "many nodes"],
)
def test_more_work_than_the_file_accounts_for_is_refused(nodes, constant):
    index = numpy_helper.from_array(np.zeros(5000, dtype=np.int64), "i")
    with pytest.raises(InputError, match=r"m.onnx: its graph contradicts itself, or a decision"):
        onnx_file.check(model(nodes, [constant, index]).SerializeToString(), "m.onnx")


def test_a_sparse_constant_is_refused():
    proto = model([add()])
    proto.graph.sparse_initializer.append(
        helper.make_sparse_tensor(
            numpy_helper.from_array(np.ones(1), "w"),
            numpy_helper.from_array(np.zeros(1, dtype=np.int64)),
            [1 << 40],
        )
    )
    with pytest.raises(InputError, match="its graph contradicts itself"):
        onnx_file.check(proto.SerializeToString(), "m")
