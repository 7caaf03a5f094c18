"""One decision from a feature vector, against the default conversion and
scikit-learn."""

from dataclasses import replace
from functools import partial

import numpy as np
import onnxruntime
import pytest
from skl2onnx import to_onnx
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from threadpoolctl import threadpool_limits

from edge.demo import MODEL
from edge.model.info import Task
from edge.model.model import Model
from export import graph
from train.pipeline import Choice, ContactClassifier

TARGETS = {140: (10, 20), 1000: (50, 15), 10000: (100, 4)}
"""{training rows: times that skl2onnx's graph takes as long, and scikit-learn's
pipeline}."""
K = 2


def exported(X, y, components, path):
    fitted = ContactClassifier({"object": Choice("IV", components, K)}).fit(
        X, {"object": y}
    )
    task = Task(tuple(map(str, fitted.classes_["object"])), K, components, "IV", 0.5)
    info = replace(
        Model(MODEL).info,
        tasks={"object": task},
        rows=len(X),
        trials=(),
        decision_points_s=(),
        stopping={},
        novelty=None,
    )
    path.write_bytes(graph.to_onnx(fitted, info))
    return Model(path)


def session(model):
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    return onnxruntime.InferenceSession(model, options)


@pytest.mark.parametrize("components", [7, 20])
@pytest.mark.parametrize("rows", TARGETS)
def bench_decision(rows, components, against, tmp_path):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(rows, 120)) * np.repeat([1.0, 30.0, 0.02], 40)
    y = np.array([f"object {i:02d}" for i in rng.integers(0, 18, rows)])
    model = exported(X, y, components, tmp_path / "model.onnx")
    usual = make_pipeline(
        StandardScaler(), PCA(components, svd_solver="full"), KNeighborsClassifier(K)
    ).fit(X, y)
    converted = to_onnx(usual, X[:1].astype(np.float32), options={"zipmap": False})
    vector = X[0] + 0.1
    calls = 200 if rows < 5000 else 10
    ours = partial(session(model.path).run, None, {"features": vector[None]})
    theirs = session(converted.SerializeToString())
    single = {theirs.get_inputs()[0].name: vector[None].astype(np.float32)}
    of_graph, of_fit = (1.0 / times for times in TARGETS[rows])
    with threadpool_limits(1):
        rivals = {"skl2onnx's own graph": partial(theirs.run, None, single)}
        against(ours, rivals, most=dict.fromkeys(rivals, of_graph), calls=calls)
        rivals = {
            "scikit-learn, from vector to label": partial(usual.predict, vector[None])
        }
        against(
            partial(model.decide, vector),
            rivals,
            most=dict.fromkeys(rivals, of_fit),
            calls=calls,
        )
