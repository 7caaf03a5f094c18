"""`make stopping`: deciding when sure beside fixed windows and beside others' early decisions.

All decide on the same five folds. Extra trees decide at the first point at which their highest
class probability passes a threshold. CALIMERA (Bilski and Jastrzebska, CALIMERA: a new early time
series classification method, 2023) decides on the same features with calibrated ridge classifiers,
at several prices of waiting. TEASER (Schäfer and Leser, TEASER: early and accurate time series
classification, 2020) and a threshold of the probability are aeon's (`pip install aeon`), on the
paper's three features as series, with aeon's time series forest as classifier. Columns are compared
at the same mean time, between two thresholds or prices by interpolation. The gain is by how much
deciding when sure errs less than the fixed window; its standard error treats the two shares as
independent, which overstates it.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.calibration import CalibratedClassifierCV
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import RidgeClassifier
from sklearn.model_selection import cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from edge.cli import dispatch
from edge.model.stopping import StoppingRule
from edge.touch.features import FEATURES, SAMPLES
from train.agreement import factors_of
from train.dataset import read
from train.evaluate import stratified_folds
from train.feature_sets import expand
from train.rules import NEVER, THRESHOLDS, Course
from train.stopping import finest
from train.tradeoff.choices import WINDOWS_S as DECISION_POINTS_S
from train.tradeoff.choices import followed, trials_of
from train.tradeoff.early import FOLDS, StoppingComparison, compare_stopping

TREES = 300
WAITING = (0.03, 0.1, 0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5)
"""Prices of waiting for the full window, in wrong decisions."""
AEON = {"TEASER": "TEASER", "ProbabilityThresholdEarlyClassifier": "threshold 0.85"}
"""Early classifiers of aeon, and the heads of their columns."""
NAMES = ("paper", "contact")
"""The features of the extra trees."""
Curve = list[tuple[float, float]]
"""(mean seconds, share wrong) at each threshold."""


def extra_trees(
    X: NDArray[np.float64], labels: NDArray[np.str_], folds: NDArray[np.int64], jobs: int
) -> Curve:
    """Extra trees at each decision point, X (points, n, p), that decide when sure."""
    right = np.empty(X.shape[:2], dtype=bool)
    confidence = np.empty(X.shape[:2])
    for fold in range(FOLDS):
        test = folds == fold
        for point, vectors in enumerate(X):
            model = ExtraTreesClassifier(TREES, n_jobs=jobs, random_state=0)
            shares = model.fit(vectors[~test], labels[~test]).predict_proba(vectors[test])
            right[point, test] = model.classes_[shares.argmax(axis=1)] == labels[test]
            confidence[point, test] = shares.max(axis=1)
    seconds, trials = np.array(DECISION_POINTS_S), np.arange(len(labels))
    confidence[-1] = 1.0
    stops = [(confidence >= threshold).argmax(axis=0) for threshold in THRESHOLDS]
    return [(float(seconds[at].mean()), 1.0 - float(right[at, trials].mean())) for at in stops]


def halts(
    known: NDArray[np.float64], new: NDArray[np.float64], waiting: NDArray[np.float64]
) -> NDArray[np.int64]:
    """(m,) the point at which CALIMERA decides: the first at which no later one is cheaper.

    At each point but the last a kernel ridge regression on the two highest probabilities predicts
    how much cheaper it is to go on, from the last point to the first.

    Args:
        known: (points, n, classes) probabilities of trials that no part of their model has seen.
        new: (points, m, classes) probabilities of the trials to decide.
        waiting: (points,) price of waiting, in wrong decisions.
    """
    known, new = np.sort(known)[..., -2:], np.sort(new)[..., -2:]
    prices = 1.0 - known[..., -1] + waiting[:, None]
    best, at = prices[-1], np.full(new.shape[1], len(waiting) - 1)
    for point in range(len(waiting) - 2, -1, -1):
        model = KernelRidge(kernel="rbf").fit(known[point], prices[point] - best)
        best = np.where(model.predict(known[point]) <= 0.0, prices[point], best)
        at[model.predict(new[point]) <= 0.0] = point
    return at


def calimera(X: NDArray[np.float64], labels: NDArray[np.str_], folds: NDArray[np.int64]) -> Curve:
    """CALIMERA at each decision point, X (points, n, p), a row for each of `WAITING`."""
    seconds = np.array(DECISION_POINTS_S)
    at = np.empty((len(WAITING), len(labels)), dtype=np.int64)
    right = np.empty(X.shape[:2], dtype=bool)
    ridge = make_pipeline(StandardScaler(), RidgeClassifier(alpha=10.0))
    for fold in range(FOLDS):
        test = folds == fold
        known, new = [], []
        for point, vectors in enumerate(X):
            model = CalibratedClassifierCV(ridge, cv=2)
            train = vectors[~test], labels[~test]
            known.append(cross_val_predict(model, *train, cv=3, method="predict_proba"))
            new.append(model.fit(*train).predict_proba(vectors[test]))
            right[point, test] = model.classes_[new[-1].argmax(axis=1)] == labels[test]
        for i, price in enumerate(WAITING):
            at[i, test] = halts(np.array(known), np.array(new), price * seconds / seconds[-1])
    trials = np.arange(len(labels))
    return [(float(seconds[a].mean()), 1.0 - float(right[a, trials].mean())) for a in at]


def of_aeon(
    name: str, series: NDArray[np.float64], labels: NDArray[np.str_], folds: NDArray[np.int64]
) -> tuple[float, float]:
    """(mean seconds, share wrong) of aeon's classifier `name` on series (n, features, samples)."""
    module = importlib.import_module("aeon.classification.early_classification")
    forests = importlib.import_module("aeon.classification.interval_based")
    looks = DECISION_POINTS_S[::2]  # half as many, as the forests are slow
    points = [round(s / looks[-1] * (SAMPLES - 1)) + 1 for s in looks]
    seconds, wrong = [], []
    for fold in range(FOLDS):
        test = folds == fold
        forest = forests.TimeSeriesForestClassifier(n_estimators=50, random_state=0)
        make = getattr(module, name)
        model: Any = make(forest, classification_points=points, random_state=0)
        model.fit(series[~test], labels[~test])
        named, stop = np.empty(test.sum(), dtype=labels.dtype), np.zeros(test.sum(), dtype=int)
        waiting = np.arange(test.sum())
        for look, point in enumerate(points):
            ask = model.update_predict if look else model.predict
            answers, sure = ask(series[test][waiting][:, :, :point])
            sure = np.asarray(sure)
            named[waiting[sure]], stop[waiting[sure]] = answers[sure], look
            waiting = waiting[~sure]
            if not len(waiting):
                break
        seconds += [looks[look] for look in stop]
        wrong += (named != labels[test]).tolist()
    return float(np.mean(seconds)), float(np.mean(wrong))


def at(rows: Curve, seconds: float) -> float:
    """The share wrong at a mean time, interpolated; NaN before the soonest decision."""
    times, wrong = zip(*sorted(rows), strict=True)
    return float(np.interp(seconds, times, wrong, left=np.nan))


def when_sure(parts: Sequence[StoppingComparison]) -> Curve:
    """Stopping at each threshold, of a task that is decided when each of these is sure."""
    seconds = np.array(DECISION_POINTS_S)
    course = Course([p.confidence for p in parts], [~p.right for p in parts], parts[0].unknown)
    curve = []
    for threshold in (NEVER, *THRESHOLDS.tolist()):
        stops, wrong = course.under(StoppingRule(1.0, 0.0, threshold, len(seconds) - 1))
        curve.append((float(seconds[stops].mean()), float(wrong.mean())))
    return curve


def run(arguments: argparse.Namespace) -> int:
    """Measure and print the table."""
    dataset = followed(read(arguments.data), NAMES)
    n = len(dataset.trials)
    rows = np.sort(np.random.default_rng(0).permutation(n)[: arguments.trials or n])
    dataset = trials_of(dataset, rows)
    y = {task: dataset.labels(task) for task in dataset.tasks}
    X = np.stack([dataset.features(s, SAMPLES, expand(NAMES)) for s in DECISION_POINTS_S])
    compared = compare_stopping(dataset, DECISION_POINTS_S, jobs=arguments.jobs)
    factors = factors_of(y)
    folds = stratified_folds(y[finest(y)], FOLDS)
    paper = dataset.features(DECISION_POINTS_S[-1], SAMPLES, expand(["paper"]))
    series = paper.reshape(len(rows), len(FEATURES), SAMPLES)
    others = list(AEON) if importlib.util.find_spec("aeon") is not None else []
    columns = ["task", "mean time, s", "fixed window, % wrong", "when sure", "gain", "trees"]
    print("|", " | ".join([*columns, "CALIMERA", *(AEON[name] for name in others)]), "|")
    print("|---" * (7 + len(others)) + "|")
    for task, ours in compared.items():
        waiting = 1.0 - ours.right.mean(axis=1)
        fixed = list(zip(ours.decision_points_s, waiting.tolist(), strict=True))
        sure = when_sure([compared[factor] for factor in factors.get(task, [task])])
        trees = extra_trees(X, y[task], folds, arguments.jobs)
        cheapest = calimera(X, y[task], folds)
        aeons = [of_aeon(name, series, y[task], folds) for name in others]
        for seconds in sorted({*DECISION_POINTS_S, *(mean_s for mean_s, _ in aeons)}):
            waited, stopped, *curves = (
                100 * at(way, seconds) for way in (fixed, sure, trees, cheapest)
            )
            shares = [f"{100 * wrong:.1f}" * (mean_s == seconds) for mean_s, wrong in aeons]
            error = np.sqrt((waited * (100 - waited) + stopped * (100 - stopped)) / len(rows))
            print(
                f"| {task} | {seconds:.2f} | {waited:.1f} | {stopped:.1f} | "
                f"{waited - stopped:.1f} ± {error:.1f} | "
                + " | ".join([*(f"{wrong:.1f}" for wrong in curves), *shares])
                + " |"
            )
    rules = ((name, rule) for name, ours in compared.items() for rule in ours.certified)
    for name, rule in rules:
        if rule.folds:
            print(
                f"{name}, at most {rule.asked:g} wrong: certified in {rule.folds} of {FOLDS} "
                f"folds, {rule.wrong:.1%} wrong ({rule.unknown:.1%} unknown) at {rule.mean_s:.2f} s"
            )
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="bench.stopping", description=__doc__)
    top.add_argument("--data", nargs="+", required=True, metavar="REC", help=".npz or folders")
    top.add_argument("--trials", type=int, help="use this many of them (default: all)")
    top.add_argument("--jobs", type=int, default=2, help="processes (%(default)s)")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
