"""One decision from a feature vector, against the default conversion and scikit-learn."""

from dataclasses import replace

import numpy as np
import onnxruntime
import pytest
from skl2onnx import to_onnx
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from edge.demo import MODEL
from edge.model.info import Task
from edge.model.model import Model
from export import graph
from train.pipeline import Choice, ContactClassifier

TARGETS = {140: (10, 20), 1000: (50, 15), 10000: (100, 4)}
"""{training rows: how many times faster than skl2onnx's graph, and than scikit-learn}."""
K = 2


def quiet():
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    options.log_severity_level = 3
    return options


def features(n):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(n, 120)) * np.repeat([1.0, 30.0, 0.02], 40)
    return X, np.array([f"object {i:02d}" for i in rng.integers(0, 18, n)])


def exported(X, y, components, path):
    fitted = ContactClassifier({"object": Choice("IV", components, K)}).fit(X, {"object": y})
    labels = tuple(map(str, fitted.classes_["object"]))
    task = Task(labels, K, components, "IV", 0.5)
    info = replace(Model(MODEL).info, tasks={"object": task}, rows=len(X), trials=())
    path.write_bytes(graph.to_onnx(fitted, info))
    return Model(path)


@pytest.mark.parametrize("components", [7, 20])
@pytest.mark.parametrize("rows", TARGETS)
def bench_decision(rows, components, against, tmp_path):
    X, y = features(rows)
    model = exported(X, y, components, tmp_path / "model.onnx")
    usual = make_pipeline(
        StandardScaler(), PCA(components, svd_solver="full"), KNeighborsClassifier(K)
    ).fit(X, y)
    converted = to_onnx(usual, X[:1].astype(np.float32), options={"zipmap": False})
    session = onnxruntime.InferenceSession(
        converted.SerializeToString(), quiet(), providers=["CPUExecutionProvider"]
    )
    vector = X[0] + 0.1
    row, single = vector[None], vector[None].astype(np.float32)
    outputs = [output.name for output in session.get_outputs()]
    inputs = session.get_inputs()[0].name
    rivals = {
        "skl2onnx's own": lambda: session.run(outputs, {inputs: single}),
        "scikit-learn": lambda: usual.predict(row),
    }
    against(
        lambda: model.decide(vector),
        rivals,
        most={name: 1.0 / times for name, times in zip(rivals, TARGETS[rows], strict=True)},
        calls=20 if rows < 5000 else 3,
    )
