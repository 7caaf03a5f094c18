"""Nodes and constants of a graph."""

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from export.build import OPSET, Builder, widened
from tests.hard_cases.models import session


class Names:
    """Names and initialisers, kept as skl2onnx's scope and container keep them."""

    def __init__(self):
        self.nodes = []
        self.initial = []
        self.count = 0

    def get_unique_variable_name(self, name):
        self.count += 1
        return f"{name}{self.count}"

    get_unique_operator_name = get_unique_variable_name

    def add_initializer(self, name, kind, shape, tensor):
        tensor.name = name
        self.initial.append(tensor)

    def add_node(self, operator, inputs, outputs, *, op_version, **attributes):
        node = helper.make_node(operator, inputs, outputs, **attributes)
        self.nodes.append(node)


@pytest.fixture
def graph():
    """A builder, and a function that runs its graph from x to the named output."""
    names = Names()

    def run(output, x):
        before, after = (
            [helper.make_tensor_value_info(name, TensorProto.DOUBLE, [None, None])]
            for name in ("x", output)
        )
        graph_proto = helper.make_graph(names.nodes, "g", before, after, names.initial)
        opset = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(graph_proto, opset_imports=opset, ir_version=8)
        onnx.checker.check_model(model)
        (value,) = session(model.SerializeToString()).run([output], {"x": x})
        return value

    return Builder(names, names), names, run


def test_equal_constants_are_stored_once(graph):
    build, names, _ = graph
    assert build.constant(2.0) == build.constant(2.0)
    assert build.constant([1, 2]) == build.constant([1, 2])
    assert len({build.constant(v) for v in (2.0, [2.0], np.float32(2.0))}) == 3
    assert build.constant(0.0) != build.constant(-0.0)
    assert len(names.initial) == 5 + 1


@pytest.mark.parametrize(
    ("x", "inside", "off"),
    [
        ([3.0, -4.0], [3.0, -4.0], 0.0),
        ([6.0, -9.0], [4.0, -4.0], 7.0),
        ([np.inf, 0.0], [4.0, 0.0], np.inf),
    ],
)
def test_the_sum_of_all_that_was_cut_off_is_given(graph, x, inside, off):
    build, _, run = graph
    clipped, rest = build.clipped("x", [4.0])
    assert run(clipped, np.array([x])).tolist() == [inside]
    assert run(rest, np.array([x])).tolist() == [[off]]


def test_what_was_cut_off_a_nan_is_no_number(graph):
    build, _, run = graph
    assert np.isnan(run(build.clipped("x", [4.0])[1], np.array([[np.nan, 1.0]]))).all()


def test_constants_of_several_decision_points_are_stored_in_float32_where_it_holds_them(
    graph,
):
    build, names, _ = graph
    build.decision_point = build.constant(1)
    kinds = {TensorProto.FLOAT: 2.0**24, TensorProto.DOUBLE: 2.0**24 + 1.0}
    for kind, value in kinds.items():
        build.by_decision_point_small([np.array([1.0]), np.array([value])])
        assert names.initial[-1].data_type == kind


def test_widened_columns_are_zero():
    narrow, wide = widened([np.ones((2, 1)), np.ones((2, 3))], 3)
    assert narrow.tolist() == [[1.0, 0.0, 0.0]] * 2
    assert wide.tolist() == [[1.0, 1.0, 1.0]] * 2


def test_a_named_constant_has_a_row_for_each_decision_point(graph):
    build, names, _ = graph
    names.initializers = names.initial
    build.decision_point = "point"
    build.by_decision_point([np.ones(2)] * 3, "rows")
    assert list(names.initial[0].dims) == [3, 2]
