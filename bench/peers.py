"""What else could decide, on our features and the same folds: `python -m bench.peers DATA`.

Extra trees, and neighbourhood components analysis (a learned metric) before the neighbours, beside
the discriminants that `make export` fits. They are worth a place in the model if they lead by more
than two points on trials left out and on objects left out both.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray
from sklearn.decomposition import PCA
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.neighbors import KNeighborsClassifier, NeighborhoodComponentsAnalysis
from sklearn.pipeline import make_pipeline
from threadpoolctl import threadpool_limits

from edge.cli import dispatch
from edge.touch.feature_sets import expand
from train.choose import LEAVE_OUT, UNSEEN_SHRINKAGE
from train.dataset import load_trials, read
from train.evaluate import SHRINKAGES, SearchGrid, evaluate, group_folds, stratified_folds
from train.projection import Projection

SETS = ("contact", "moments")
TREES = 300
COMPONENTS, K, STEPS = 60, 3, 30

Vectors = NDArray[np.float64]
Labels = NDArray[np.str_]


def trees(X: Vectors, y: Labels, new: Vectors) -> Labels:
    """Extra trees."""
    return np.asarray(ExtraTreesClassifier(TREES, random_state=0).fit(X, y).predict(new))


def learned_metric(X: Vectors, y: Labels, new: Vectors) -> Labels:
    """Principal components, neighbourhood components analysis that begins at LDA, neighbours."""
    kept = min(COMPONENTS, len(X) - 1, X.shape[1])
    metric = NeighborhoodComponentsAnalysis(
        min(len(set(y)) - 1, kept), init="lda", max_iter=STEPS, random_state=0
    )
    pipe = make_pipeline(PCA(kept), metric, KNeighborsClassifier(K)).fit(X, y)
    return np.asarray(pipe.predict(new))


PEERS: dict[str, Callable[[Vectors, Labels, Vectors], Labels]] = {
    "extra trees": trees,
    "NCA": learned_metric,
}


def run(arguments: argparse.Namespace) -> int:
    """Score and print."""
    raw = read(arguments.data)
    sets = [(name, "joints") if raw.joints else (name,) for name in SETS]
    names = expand([name for one in sets for name in one])
    dataset = load_trials(raw, horizon_s=1.2, features=names)
    y = {task: dataset.labels(task) for task in dataset.tasks}
    groups = dataset.groups(LEAVE_OUT)
    folds = {"trials": stratified_folds(y[max(y, key=lambda task: len(set(y[task])))])}
    if groups is not None and len(y) > 1:
        folds["objects"] = group_folds(groups, 20 if len(groups) <= 300 else 10)
    print(f"{'left out':<9}{'features':<16}{'task':<10}{'LDA':>8}", end="")
    print("".join(f"{name:>13}" for name in PEERS))
    for one in sets:
        part = dataset.of(expand(one))
        X, widths = part.features(), part.widths()
        for how, fold in folds.items():
            least = UNSEEN_SHRINKAGE if how == "objects" else 0.0
            grid = SearchGrid(
                "IV",
                "lda",
                shrinkages=tuple(s for s in SHRINKAGES if s >= least),
                neighbours=(1, 3, 5),
            )
            table = evaluate(X, y, fold, [grid], features=part.names, widths=widths)
            for task, labels in y.items():
                if how == "objects" and task == LEAVE_OUT:
                    continue
                line = f"{how:<9}{' '.join(one):<16}{task:<10}{table.nested(task).accuracy:>8.1%}"
                for peer in PEERS.values():
                    right = 0
                    for i in range(int(fold.max()) + 1):
                        own = fold == i
                        scale = Projection("IV", 1, part.names, widths=widths).fit(X[~own])
                        d = (X - scale.mean_) * scale.gain_
                        with threadpool_limits(1):
                            right += int((peer(d[~own], labels[~own], d[own]) == labels[own]).sum())
                    line += f"{right / len(labels):>13.1%}"
                print(line, flush=True)
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command; 0 fine, 2 bad usage or input."""
    top = argparse.ArgumentParser(prog="bench.peers", description=__doc__.split("\n\n")[0])
    top.add_argument("data", nargs="+", help=".npz recordings or folders of them")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
