"""Measure the time, size and labels of a model in other number formats, on the graph
that ships.

The exported graph computes on whole numbers in float64. This program runs it beside
three copies: one that rounds nothing to whole numbers, one with every number in float32
besides, and one whose matrices are in int8 besides (ONNX Runtime's dynamic
quantisation). Each row says the time of a decision, the size, how many labels become
others, and how many of the neighbours' distances have other bits where a vector is
decided alone than where all are decided at once.
"""

import argparse
import json
import logging
import statistics
import tempfile
import timeit
from collections.abc import Sequence
from copy import deepcopy
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, numpy_helper

from edge.arrays import Integers
from edge.cli import dispatch
from edge.errors import InputError
from edge.model.model import Model
from edge.recording import load_arrays
from edge.writing import write_whole

ROUNDS = 7
CALLS = 200


def _round_to_float32(tensor: onnx.TensorProto) -> None:
    """Turn a tensor of float64 into one of float32; a limit beyond its range becomes
    infinite."""
    if tensor.data_type in (TensorProto.DOUBLE, TensorProto.INT16):
        with np.errstate(over="ignore"):
            values = numpy_helper.to_array(tensor).astype(np.float32)
        tensor.CopyFrom(numpy_helper.from_array(values, tensor.name))


def _without(graph: onnx.GraphProto, nodes: Sequence[onnx.NodeProto]) -> None:
    """Remove nodes of one input and one output: their input takes the place of their
    output."""
    source_of = {node.output[0]: node.input[0] for node in nodes}
    for node in nodes:
        graph.node.remove(node)
    for node in graph.node:
        node.input[:] = [source_of.get(name, name) for name in node.input]


def unrounded(model: onnx.ModelProto) -> onnx.ModelProto:
    """A copy of a graph that rounds nothing to whole numbers."""
    copy = deepcopy(model)
    _without(copy.graph, [node for node in copy.graph.node if node.op_type == "Round"])
    return copy


def in_float32(model: onnx.ModelProto) -> onnx.ModelProto:
    """A copy of a graph with every float64 in float32."""
    copy = deepcopy(model)
    graph = copy.graph
    for tensor in graph.initializer:
        _round_to_float32(tensor)
    for value in (*graph.input, *graph.output, *graph.value_info):
        if value.type.tensor_type.elem_type == TensorProto.DOUBLE:
            value.type.tensor_type.elem_type = TensorProto.FLOAT
    for node in graph.node:
        _compute_in_float32(node)
    # Matrices are stored in float32 already; nothing is left to convert.
    stored = {tensor.name for tensor in graph.initializer}
    casts = [node for node in graph.node if node.op_type == "Cast"]
    _without(graph, [node for node in casts if node.input[0] in stored])
    return copy


def _compute_in_float32(node: onnx.NodeProto) -> None:
    """Give a node's attributes float32 for float64."""
    for attribute in node.attribute:
        if node.op_type == "Cast" and attribute.i == TensorProto.DOUBLE:
            attribute.i = TensorProto.FLOAT
        elif attribute.HasField("t"):
            _round_to_float32(attribute.t)


def in_int8(model: onnx.ModelProto, folder: Path) -> onnx.ModelProto:
    """A copy of a float32 graph whose matrices are in int8."""
    from onnxruntime.quantization import quantize_dynamic

    # It advises steps that change nothing here.
    logging.getLogger().setLevel(logging.ERROR)
    before = folder / "float32.onnx"
    after = folder / "int8.onnx"
    onnx.save(model, before)
    quantize_dynamic(before, after)
    return onnx.load(after)


def answers(
    model: onnx.ModelProto,
    vectors: NDArray[Any],
    tasks: list[str],
) -> tuple[Integers, float, float]:
    """The labels (tasks * n) of vectors, and the median microseconds of one decision.

    Last comes the share of the distances with other bits where each vector is decided
    alone.
    """
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    options.graph_optimization_level = (
        onnxruntime.GraphOptimizationLevel.ORT_ENABLE_BASIC
    )
    session = onnxruntime.InferenceSession(
        model.SerializeToString(),
        options,
        providers=["CPUExecutionProvider"],
    )

    def run(inputs: NDArray[Any], output: str) -> NDArray[Any]:
        names = [f"{task}_{output}" for task in tasks]
        return np.concatenate(session.run(names, {"features": inputs}), axis=-1)

    def decide() -> None:
        session.run(None, {"features": next(queries)[None]})

    labels = run(vectors, "label")
    alone = np.vstack([run(vector[None], "distances") for vector in vectors])
    changed = float((alone != run(vectors, "distances")).mean())
    queries = cycle(vectors)
    seconds = timeit.repeat(decide, number=CALLS, repeat=ROUNDS)
    return labels, statistics.median(seconds) / CALLS * 1e6, changed


def compare(model: Path, golden: Path) -> list[dict[str, Any]]:
    """A row for each number format: time, size, labels and distances that become
    others.

    Args:
        model: an exported model.
        golden: its golden file, whose finite vectors are decided on.

    Raises:
        InputError: a file is missing, or no such file.
    """
    info = Model(model).info
    tasks = list(info.tasks)
    vectors = load_arrays(golden).get("vectors")
    if vectors is None or vectors.ndim != 2 or vectors.shape[1] != info.width:
        raise InputError(
            f"{golden}: has no vectors of {info.width} features; give the golden file "
            "that was exported with the model"
        )
    vectors = vectors[np.isfinite(vectors).all(axis=1)]
    shipped = onnx.load(model)
    real = unrounded(shipped)
    in_single = in_float32(real)
    with tempfile.TemporaryDirectory() as folder:
        formats = {
            "whole numbers in float64 (as shipped)": (shipped, np.float64),
            "float64, nothing rounded": (real, np.float64),
            "float32": (in_single, np.float32),
            "int8 matrices": (in_int8(in_single, Path(folder)), np.float32),
        }
    rows: list[dict[str, Any]] = []
    expected = None
    for name, (graph, dtype) in formats.items():
        labels, microseconds, changed = answers(graph, vectors.astype(dtype), tasks)
        expected = labels if expected is None else expected
        rows.append(
            {
                "format": name,
                "decision us": round(microseconds, 1),
                "size kB": round(graph.ByteSize() / 1e3, 1),
                "other labels %": round(100 * float((labels != expected).mean()), 2),
                "other distances alone %": round(100 * changed, 1),
            }
        )
    return rows


def run(arguments: argparse.Namespace) -> int:
    """Compare, and write the rows."""
    rows = compare(arguments.model, arguments.golden)
    with write_whole(arguments.out) as file:
        file.write(json.dumps(rows, indent=1).encode() + b"\n")
    for row in rows:
        print(", ".join(f"{key} {value}" for key, value in row.items()))
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program; returns 0 for success, 2 for bad usage or input."""
    top = argparse.ArgumentParser(prog="export.arithmetic", description=__doc__)
    top.add_argument("--model", type=Path, required=True, help="model.onnx")
    top.add_argument("--golden", type=Path, required=True, help="its golden.npz")
    top.add_argument("--out", type=Path, required=True, help="the JSON file to write")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    raise SystemExit(main())
