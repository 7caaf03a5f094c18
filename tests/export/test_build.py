"""Nodes and constants of a graph."""

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from edge.decide.onnx_file import OPSET
from export.build import Builder
from tests.checks.hard_cases.models import session


@pytest.fixture
def graph():
    """A builder, and a function that runs its graph from x to the named output."""
    build = Builder()

    def run(output, x):
        before, after = (
            [helper.make_tensor_value_info(name, TensorProto.DOUBLE, [None, None])]
            for name in ("x", output)
        )
        constants = list(build.constants.values())
        graph_proto = helper.make_graph(build.made, "g", before, after, constants)
        opset = [helper.make_opsetid("", OPSET)]
        model = helper.make_model(graph_proto, opset_imports=opset, ir_version=8)
        onnx.checker.check_model(model)
        (value,) = session(model.SerializeToString()).run([output], {"x": x})
        return value

    return build, run


def test_a_constant_is_stored_once_and_a_literal_is_called_by_its_value():
    build = Builder()
    literals = (2.0, 2.0, [1, 2], [2.0], np.float32(2.0), 0.0, -0.0)
    assert list(map(build.constant, literals)) == [
        "float64 2.0",
        "float64 2.0",
        "int64 [1, 2]",
        "float64 [2.0]",
        "float32 2.0",
        "float64 0.0",
        "float64 -0.0",
    ]
    assert len(build.constants) == 6


@pytest.mark.parametrize(
    ("x", "inside", "off"),
    [
        ([3.0, -4.0], [3.0, -4.0], 0.0),
        ([6.0, -9.0], [4.0, -4.0], 7.0),
        ([np.inf, 0.0], [4.0, 0.0], np.inf),
        ([np.nan, 1.0], [np.nan, 1.0], np.nan),
    ],
)
def test_the_sum_of_all_that_was_cut_off_is_given(graph, x, inside, off):
    build, run = graph
    clipped, rest = build.clipped("x", [4.0], "limit")
    np.testing.assert_array_equal(run(clipped, np.array([x])), [inside])
    np.testing.assert_array_equal(run(rest, np.array([x])), [[off]])
