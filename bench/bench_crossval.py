"""Leave-one-out over 20 components and 20 k against scikit-learn's grid search.

The search fits every fold of every cell anew, so its time is proportional to its cells: it is
timed on `CELLS` of the 400 and multiplied. Both run on one thread, where both are fastest.
"""

import time

import numpy as np
from sklearn.decomposition import PCA
from sklearn.model_selection import GridSearchCV, LeaveOneOut
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import Pipeline
from threadpoolctl import threadpool_limits

from train.crossval import leave_one_out

CELLS = {"pca__n_components": [3, 20], "knn__n_neighbors": [2]}
LEAST = 1000
"""How many times faster; measured on one core each."""


def bench_crossval_140_x_120(against, note):
    rng = np.random.default_rng(0)
    y = np.array([f"object {i % 18:02d}" for i in range(140)])
    X = rng.normal(size=(140, 120)).cumsum(axis=1) + rng.normal(size=(18, 1))[np.arange(140) % 18]
    pipeline = Pipeline([("pca", PCA(svd_solver="full")), ("knn", KNeighborsClassifier())])
    search = GridSearchCV(pipeline, CELLS, cv=LeaveOneOut(), refit=False)
    leave_one_out(X, y)
    theirs = []
    for _ in range(3):
        began = time.perf_counter()
        with threadpool_limits(1):
            search.fit(X, y)
        theirs.append((time.perf_counter() - began) * 400 / 2)
    mine = against(lambda: leave_one_out(X, y), {}, calls=1, rounds=5)
    note("GridSearchCV, 2 of 400 cells", mine / float(np.median(theirs)), f"at most {1 / LEAST:g}")
