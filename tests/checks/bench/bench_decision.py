"""One decision from a feature vector, against the default conversion and
scikit-learn."""

from functools import partial

import numpy as np
import pytest
from skl2onnx import to_onnx
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from threadpoolctl import threadpool_limits

from tests.checks.hard_cases.models import Ours, session
from train.model.pipeline import Choice

TARGETS = {140: (1 / 10, 1 / 20), 1000: (1 / 50, 1 / 15), 10000: (1 / 100, 1 / 4)}
"""{training rows: largest time of ours, over those of skl2onnx's graph and of
scikit-learn's pipeline}."""
BRUTE = 20
"""From 16 components on scikit-learn compares with all rows, not by a tree, which takes
it half as long with up to 1,000 rows; ours compares with all rows always."""
K = 2


@pytest.mark.parametrize("components", [7, BRUTE])
@pytest.mark.parametrize("rows", TARGETS)
def bench_decision(rows, components, against):
    rng = np.random.default_rng(0)
    X = rng.normal(size=(rows, 120)) * np.repeat([1.0, 30.0, 0.02], 40)
    y = np.array([f"object {i:02d}" for i in rng.integers(0, 18, rows)])
    ours = Ours(X, y, Choice("IV", components, K))
    usual = make_pipeline(
        StandardScaler(),
        PCA(components, svd_solver="full"),
        KNeighborsClassifier(K),
    ).fit(X, y)
    converted = to_onnx(usual, X[:1].astype(np.float32), options={"zipmap": False})
    vector = X[0] + 0.1
    calls = 200 if rows < 5000 else 10
    graph = partial(session(ours.data).run, None, {"features": vector[None]})
    theirs = session(converted.SerializeToString())
    single = {theirs.get_inputs()[0].name: vector[None].astype(np.float32)}
    of_graph, of_fit = TARGETS[rows]
    if components == BRUTE and rows <= 1000:
        of_fit *= 2
    whole = partial(usual.predict, vector[None])
    with threadpool_limits(1):
        rival = {"skl2onnx's own graph": (partial(theirs.run, None, single), of_graph)}
        against(graph, rival, calls=calls)
        rival = {"scikit-learn, from vector to label": (whole, of_fit)}
        against(partial(ours.model.decide, vector), rival, calls=calls)
