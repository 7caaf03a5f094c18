"""Models of the project and of the usual stack on the same training vectors."""

from __future__ import annotations

import math
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import onnx
import onnxruntime
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper
from skl2onnx import to_onnx as convert
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline

from edge.model.info import ModelInfo, Task
from edge.model.model import Model
from edge.touch.features import FEATURES
from edge.touch.layout import SkinLayout
from edge.touch.track import TrackSettings
from export import graph
from export.build import Builder
from export.graph import to_onnx
from tests.hard_cases import exact
from train.pipeline import Choice, ContactClassifier

Array = NDArray[np.float64]


def features(n: int, seed: int = 0) -> Array:
    """(n, 120) vectors with the scales of force, area and motion."""
    rng = np.random.default_rng(seed)
    X = rng.gamma(2.0, size=(n, 120))
    X[:, 40:80] *= 30.0
    X[:, 80:] *= 0.02
    return X


def describe(fitted: ContactClassifier, samples: int = 40) -> ModelInfo:
    """Metadata for a model that was fitted on vectors alone."""
    return ModelInfo(
        tasks={
            task: Task(
                tuple(map(str, fitted.classes_[task])),
                choice.k,
                fitted.components_[task],
                choice.scaling,
                0.0,
            )
            for task, choice in fitted.choices.items()
        },
        layout=SkinLayout(16, 24, True),
        tracking=TrackSettings(),
        window_s=1.2,
        samples=samples,
        features=FEATURES,
        units=dict.fromkeys(FEATURES, ""),
        motion_frame="skin",
        chain=None,
        rows=len(next(iter(fitted.labels_.values()))),
        data_digest="",
    )


def labels_for(X: Array, classes: int = 5, seed: int = 0) -> NDArray[np.str_]:
    """Labels that have nothing to do with the vectors: classes overlap, votes tie."""
    rng = np.random.default_rng([seed, 77])
    return np.array([f"c{i:04d}" for i in rng.integers(0, classes, len(X))])


class Ours:
    """A fitted classifier, its exported graph, and the oracle of both."""

    def __init__(
        self,
        X: Array,
        *,
        k: int = 5,
        components: int = 6,
        scaling: str = "none",
        y: NDArray[np.str_] | None = None,
    ) -> None:
        y = labels_for(X) if y is None else y
        self.fitted = ContactClassifier({"t": Choice(scaling, components, k)}).fit(X, {"t": y})
        self.k = k
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "model.onnx"
            self.data = to_onnx(self.fitted, describe(self.fitted))
            path.write_bytes(self.data)
            self.model = Model(path)
        self.projection = next(iter(self.fitted.projections_.values()))
        self.projected_rows = next(iter(self.fitted.rows_.values()))
        p, c = self.projection, self.fitted.components_["t"]
        self._parameters = (p.mean_, p.gain_, p.weights_[:, :c])
        self.rows, self.exponent = exact.coordinates(X, *self._parameters)
        self.X, self.y = X, self.fitted.labels_["t"].tolist()

    def alone(self, queries: Array) -> Mapping[str, NDArray[Any]]:
        """The graph's answers to queries one by one, as the board asks."""
        parts = [self.model.run(queries[i : i + 1]) for i in range(len(queries))]
        return {
            name.removeprefix("t_"): np.concatenate([part[name] for part in parts])
            for name in parts[0]
        }

    def judged(self, queries: Array) -> tuple[int, float]:
        """Queries whose neighbours, in order, or label are not the oracle's, and the largest
        relative error of a distance among the others."""
        # The exponent of the whole numbers must be the same for rows and queries.
        both, exponent = exact.coordinates(np.concatenate([self.X, queries]), *self._parameters)
        rows, points = both[: len(self.X)], both[len(self.X) :]
        seen = self.alone(queries)
        wrong, worst = 0, 0.0
        for i, point in enumerate(points):
            found, squares = exact.nearest(rows, point, self.k)
            label = exact.winner([self.y[j] for j in found])
            if seen["neighbours"][i].tolist() != found or seen["label"][i] != label:
                wrong += 1
                continue
            for distance, j in zip(seen["distances"][i].tolist(), found, strict=True):
                worst = max(worst, exact.root_error(distance, squares[j], 2 * exponent))
        return wrong, worst

    def unflagged(self, queries: Array) -> int:
        """Queries whose neighbours are not the oracle's, in order, and not flagged `close`."""
        both, _ = exact.coordinates(np.concatenate([self.X, queries]), *self._parameters)
        rows, points = both[: len(self.X)], both[len(self.X) :]
        wrong = 0
        for query, point in zip(queries, points, strict=True):
            said = self.model.decide(query)["t"]
            right = said.neighbours.tolist() == exact.nearest(rows, point, self.k)[0]
            wrong += not (right or said.close)
        return wrong

    def oracle_nearest(self, queries: Array) -> NDArray[np.int64]:
        """(m,) the nearest row of each query, exactly."""
        both, _ = exact.coordinates(np.concatenate([self.X, queries]), *self._parameters)
        rows, points = both[: len(self.X)], both[len(self.X) :]
        return np.array([exact.nearest(rows, point, 1)[0][0] for point in points])


def usual_pipeline(X: Array, components: int, k: int, y: Any) -> Any:
    """PCA and k-NN as scikit-learn fits them by default, brute force."""
    c = min(components, *X.shape)
    return make_pipeline(PCA(c, random_state=0), KNeighborsClassifier(k, algorithm="brute")).fit(
        X, y
    )


def session(data: bytes, level: Any = None, threads: int = 1) -> Any:
    """A session of ONNX Runtime."""
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = threads
    options.log_severity_level = 4
    if level is not None:
        options.graph_optimization_level = level
    return onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])


def converted(pipe: Any, X: Array) -> Any:
    """The default skl2onnx conversion: float32 in, its own k-NN."""
    proto = convert(pipe, X[:1].astype(np.float32), options={"zipmap": False})
    return session(proto.SerializeToString())


def plain_graph(ours: Ours, number: Any = np.float32) -> bytes:
    """Projection and direct distances alone, every number of one type: no grid, no shortlist,
    no vote, no guard."""
    p, c = ours.projection, ours.fitted.components_["t"]
    rows = ours.projected_rows[:, :c]
    constants = {
        "mean": p.mean_,
        "gain": p.gain_,
        "weights": p.weights_[:, :c],
        "columns": rows.T,
    }
    with np.errstate(over="ignore", under="ignore"):
        initial = [numpy_helper.from_array(v.astype(number), n) for n, v in constants.items()]
    initial += [
        numpy_helper.from_array(np.array([n], np.int64), name)
        for name, n in (("one", 1), ("two", 2), ("k", ours.k))
    ]
    nodes = [
        helper.make_node("Sub", ["x", "mean"], ["d"]),
        helper.make_node("Mul", ["d", "gain"], ["s"]),
        helper.make_node("MatMul", ["s", "weights"], ["z"]),
        helper.make_node("Unsqueeze", ["z", "two"], ["q"]),
        helper.make_node("Sub", ["columns", "q"], ["gaps"]),
        helper.make_node("ReduceSumSquare", ["gaps", "one"], ["squares"], keepdims=0),
        helper.make_node("TopK", ["squares", "k"], ["near", "rows"], largest=0, sorted=1),
    ]
    of = helper.np_dtype_to_tensor_dtype(np.dtype(number))
    graph = helper.make_graph(
        nodes,
        "plain",
        [helper.make_tensor_value_info("x", of, [None, p.mean_.size])],
        [
            helper.make_tensor_value_info("rows", TensorProto.INT64, [None, ours.k]),
            helper.make_tensor_value_info("near", of, [None, ours.k]),
        ],
        initial,
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 18)], ir_version=8)
    return bytes(model.SerializeToString())


def without_exactness(ours: Ours) -> bytes:
    """The whole graph, with sums of products and squares that round as they come."""

    def rounded(build: Builder, x: str, points: Sequence[Any], reach: str = "") -> tuple[str, str]:
        (p,) = points
        d = build.node("Sub", [x, build.constant(p.mean_)])
        d = build.node("Mul", [d, build.constant(p.gain_)])
        length = build.node("ReduceL2", [d, build.ints(1)], reach, keepdims=0)
        return build.node("MatMul", [d, build.constant(p.weights_)]), length

    def summed(build: Builder, gaps: str, components: int, axis: int) -> str:
        return build.node("ReduceSumSquare", [gaps, build.ints(axis)], keepdims=0)

    with (
        patch.object(graph, "project", rounded),
        patch.object(graph, "_running", lambda build, gaps, axis: gaps),
        patch.object(graph, "_by_first", summed),
    ):
        return to_onnx(ours.fitted, describe(ours.fitted))


def without_flag(ours: Ours) -> bytes:
    """The whole graph without what `close` asks for: the next trial's distance, and the reach."""
    model = onnx.load_from_string(ours.data)
    made = {name: node for node in model.graph.node for name in node.output}
    voters = numpy_helper.from_array(np.array([ours.k], np.int64), "voters")
    model.graph.initializer.append(voters)
    (nearest,) = (node for node in model.graph.node if node.op_type == "TopK")
    nearest.input[1] = "voters"
    for name in ("t_neighbours", "t_distances"):  # all that is there now: nothing is cut off
        node = made[name]
        node.CopyFrom(helper.make_node("Identity", [node.input[0]], [name], name=node.name))
    model.graph.node.remove(made["reach"])
    kept = [output for output in model.graph.output if output.name not in ("reach", "t_next")]
    del model.graph.output[:]
    model.graph.output.extend(kept)
    return bytes(model.SerializeToString())


def microseconds(calls: Sequence[Callable[[], object]], rounds: int = 40) -> list[float]:
    """Least time of each call, taken in turns: what else the machine does then hits all alike.

    A turn is a few calls, the later ones with what they need in the processor's caches.
    """
    least = [math.inf] * len(calls)
    for _ in range(rounds):
        for i, call in enumerate(calls):
            for _ in range(4):
                began = time.perf_counter()
                call()
                least[i] = min(least[i], time.perf_counter() - began)
    return [1e6 * seconds for seconds in least]


def by_number(X: Array, components: int) -> tuple[Ours, Any]:
    """Ours and the usual pipeline, fitted so that the label is the number of the nearest row."""
    ours = Ours(X, k=1, components=components, y=np.array([f"{i:05d}" for i in range(len(X))]))
    return ours, usual_pipeline(X, components, 1, np.arange(len(X)))


def usual_neighbours(X: Array, queries: Array, *, components: int = 6) -> str:
    """Shares of wrong nearest rows against the oracle."""
    ours, pipe = by_number(X, components)
    truth = ours.oracle_nearest(queries)
    with np.errstate(all="ignore"):
        narrow = queries.astype(np.float32)
        said = {
            "scikit-learn": pipe.predict(queries),
            "skl2onnx": np.ravel(converted(pipe, X).run(None, {"X": narrow})[0]),
            "our graph in float32": nearest_plain(ours, narrow),
        }
    shares = ", ".join(f"{name} {np.mean(v != truth):.0%}" for name, v in said.items())
    return f"wrong nearest: {shares}"


def nearest_plain(ours: Ours, queries: NDArray[Any]) -> NDArray[np.int64]:
    """The nearest rows by `plain_graph` in the queries' own type."""
    said = session(plain_graph(ours, queries.dtype)).run(["rows"], {"x": queries})[0]
    return np.asarray(said[:, 0])


def price(X: Array, queries: Array, *, components: int = 6) -> str:
    """What float64 costs: times of one query at these training rows, of 5 classes."""
    ours = Ours(X, k=1, components=components)
    pipe = usual_pipeline(X, components, 1, np.unique(ours.y, return_inverse=True)[1])
    with np.errstate(all="ignore"):
        x, narrow = queries[:1], queries[:1].astype(np.float32)
    wide, single = session(plain_graph(ours, np.float64)), session(plain_graph(ours))
    whole, theirs = session(ours.data), converted(pipe, X)
    double, float32, guarded, usual = microseconds(
        [
            lambda: wide.run(["rows"], {"x": x}),
            lambda: single.run(["rows"], {"x": narrow}),
            lambda: whole.run(["t_label", "t_neighbours"], {"features": x}),
            lambda: theirs.run(None, {"X": narrow}),
        ]
    )
    return (
        f"{len(X)} rows, neighbours alone: {double:.0f} us in float64, {float32:.0f} in float32; "
        f"our whole graph {guarded:.0f} us, skl2onnx {usual:.0f} us"
    )
