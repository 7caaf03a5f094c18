"""`make stopping`: deciding when sure beside fixed windows and beside others' early decisions.

All decide on the same five folds. Extra trees decide at the first point at which their highest
class probability passes a threshold. TEASER (Schäfer and Leser, TEASER: early and accurate time
series classification, 2020) is aeon's (`pip install aeon`), on the paper's three features as
series, with its own classifier and rule. Columns are compared at the same mean time, between two
thresholds by interpolation. The gain is by how much deciding when sure errs less than the fixed
window; its standard error treats the two shares as independent, which overstates it.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sklearn.ensemble import ExtraTreesClassifier

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
    seconds, every = np.array(DECISION_POINTS_S), np.arange(len(labels))
    confidence[-1] = 1.0
    stops = [(confidence >= threshold).argmax(axis=0) for threshold in THRESHOLDS]
    return [(float(seconds[at].mean()), 1.0 - float(right[at, every].mean())) for at in stops]


def teaser(
    series: NDArray[np.float64], labels: NDArray[np.str_], folds: NDArray[np.int64]
) -> tuple[float, float]:
    """(mean seconds, share wrong) of aeon's TEASER on series (n, features, samples)."""
    module = importlib.import_module("aeon.classification.early_classification")
    looks = DECISION_POINTS_S[::2]  # half as many, as its classifiers are slow
    points = [round(s / looks[-1] * (SAMPLES - 1)) + 1 for s in looks]
    seconds, wrong = [], []
    for fold in range(FOLDS):
        test = folds == fold
        model: Any = module.TEASER(classification_points=points, random_state=0)
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
    print("| task | mean time, s | fixed window, % wrong | when sure | gain | trees | TEASER |")
    print("|---|---|---|---|---|---|---|")
    for task, ours in compared.items():
        waiting = 1.0 - ours.right.mean(axis=1)
        fixed = list(zip(ours.decision_points_s, waiting.tolist(), strict=True))
        sure = when_sure([compared[factor] for factor in factors.get(task, [task])])
        trees = extra_trees(X, y[task], folds, arguments.jobs)
        theirs: dict[float, str] = {}
        if importlib.util.find_spec("aeon") is not None:
            seconds, wrong = teaser(series, y[task], folds)
            theirs = {seconds: f"{100 * wrong:.1f}"}
        for seconds in sorted({*DECISION_POINTS_S, *theirs}):
            waited, stopped, forest = (100 * at(way, seconds) for way in (fixed, sure, trees))
            error = np.sqrt((waited * (100 - waited) + stopped * (100 - stopped)) / len(rows))
            print(
                f"| {task} | {seconds:.2f} | {waited:.1f} | {stopped:.1f} | "
                f"{waited - stopped:.1f} ± {error:.1f} | {forest:.1f} | {theirs.get(seconds, '')} |"
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
