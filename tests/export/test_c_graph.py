"""Tables and memory of a model's graph in C."""

import numpy as np

from edge import demo
from edge.decide.model import Model
from export.build import smallest
from export.c_graph import TYPES, CompiledGraph


def test_a_table_takes_the_smallest_type_that_holds_it():
    for values, kind in (
        ([0.0, -128.0], "int8"),
        ([128.0], "int16"),
        ([-32769.0], "int32"),
        ([0.5, np.inf], "float32"),
        ([0.1], "float64"),
    ):
        table = smallest(np.array(values), TYPES)
        assert table.dtype.name == kind
        assert table.tolist() == values


def test_the_arena_is_shared_by_values_that_do_not_meet():
    model = Model(demo.MODEL)
    graph = CompiledGraph(model, model.info.outputs, [0], 0)
    values = sum(len(step.outputs) * step.sizes[0] for step in graph.steps)
    assert graph.arena < values / 2
