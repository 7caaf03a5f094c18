"""`make stopping`: deciding when sure beside fixed windows and beside others' early
decisions.

All decide on the same five folds; ours has the settings of an export. Extra trees
decide at the first point at which their highest class probability passes a threshold.
CALIMERA (Bilski and Jastrzebska, CALIMERA: a new early time series classification
method, 2023) decides with calibrated ridge classifiers, at several prices of waiting.
Each of these has four sets of features, joint angles among them, and the set that errs
least at the time is shown, which favours it. "set chosen" shows extra trees as a user
could have them: their set is chosen for the trials of each fold by those of the other
folds, as ours is. Columns are compared at the same mean time, between two thresholds or
prices by interpolation, as means over the data sets. The gain is by how much deciding
when sure errs less than the fixed window. The other differences are by how much it errs
less than the peer with the lowest mean, and than the trees whose set is chosen. Standard
errors are those of the paired differences over the data sets.
"""

from typing import Any, NamedTuple

import numpy as np
from scipy.stats import sem
from sklearn.calibration import CalibratedClassifierCV
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import RidgeClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_predict
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from edge.model.info import StoppingRule
from edge.touch.features import SAMPLES
from tests.bench import tables
from tests.bench.program import start
from train.data.dataset import read
from train.data.feature_sets import expand
from train.data.folds import finest, stratified_folds
from train.model.rules import NEVER, THRESHOLDS
from train.report.work import Workers
from train.tradeoff.choices import WINDOWS_S as DECISION_POINTS_S
from train.tradeoff.choices import followed
from train.tradeoff.early import FOLDS, compare_stopping

SECONDS = np.array(DECISION_POINTS_S)
WAITING = (0.03, 0.1, 0.2, 0.3, 0.4, 0.5)
"""Prices of waiting for the full window, in wrong decisions."""
SETS = (
    "paper contact",
    "contact joints",
    "contact sqrt_joints",
    "contact moments joints",
)
"""The features of the extra trees and of CALIMERA."""
NAMES = tuple(dict.fromkeys(" ".join(SETS).split()))
FIXED = "fixed window, % wrong"
SURE = "when sure"
TREES_FIXED = "extra trees, fixed window"
PEERS = ("extra trees", "CALIMERA")
CHOSEN = "extra trees, set chosen"


# A curve is [(mean seconds, share wrong)] at each threshold or price.


def decided(stops, right):
    """(mean seconds, share wrong) of trials that are decided at the points `stops`
    (n,)."""
    hits = right[stops, np.arange(len(stops))]
    return SECONDS[stops].mean(), 1.0 - hits.mean()


def first_certain(certainty, limits):
    """(limits, n) the points at which trials are decided."""
    passed = np.stack([certainty >= limit for limit in limits])
    passed[:, -1] = True
    return passed.argmax(axis=1)


class Trees(NamedTuple):
    """What extra trees of one set of features cost.

    Attributes:
        fixed: their curve at fixed windows.
        seconds, wrong: (thresholds, n) for each trial, when sure.
    """

    fixed: Any
    seconds: Any
    wrong: Any

    def curve(self, trials=slice(None)):
        """Their curve when sure, of some trials."""
        seconds = self.seconds[:, trials].mean(axis=1)
        return list(zip(seconds, self.wrong[:, trials].mean(axis=1), strict=True))


def extra_trees(X, labels, folds):
    """The extra trees of a set of features at each decision point, X (points, n, p)."""
    model = ExtraTreesClassifier(random_state=0)
    options = {"cv": PredefinedSplit(folds), "method": "predict_proba"}
    shares = np.stack([cross_val_predict(model, x, labels, **options) for x in X])
    classes = np.unique(labels)
    right = classes[shares.argmax(axis=2)] == labels
    fixed = list(zip(SECONDS, 1.0 - right.mean(axis=1), strict=True))
    stops = first_certain(shares.max(axis=2), THRESHOLDS)
    wrong = ~right[stops, np.arange(len(labels))]
    return Trees(fixed, SECONDS[stops], wrong)


def of_chosen_set(by_set, folds):
    """The curve of extra trees whose set of features is chosen as a user has to: at each
    mean time, for the trials of a fold, by the trials of the other folds."""
    curve = []
    for seconds in SECONDS:
        taken_s = np.empty_like(by_set[0].seconds)
        wrong = np.empty(taken_s.shape)
        for fold in range(FOLDS):
            test = folds == fold
            percentages = [at([trees.curve(~test)], seconds) for trees in by_set]
            best = by_set[np.nan_to_num(percentages, nan=np.inf).argmin()]
            taken_s[:, test] = best.seconds[:, test]
            wrong[:, test] = best.wrong[:, test]
        chosen = Trees(None, taken_s, wrong)
        curve.append((seconds, at([chosen.curve()], seconds) / 100))
    return curve


def halts(calibrating, new, waiting):
    """(m,) the point at which CALIMERA decides: the first at which no later one is
    cheaper.

    At each point but the last a kernel ridge regression on the two highest
    probabilities predicts how much cheaper it is to go on, from the last point to the
    first.

    Args:
        calibrating: (points, n, classes) probabilities of trials that no part of their
            model has seen.
        new: (points, m, classes) probabilities of the trials to decide.
        waiting: (points,) price of waiting, in wrong decisions.
    """
    calibrating, new = (np.sort(shares)[..., -2:] for shares in (calibrating, new))
    prices = 1.0 - calibrating[..., -1] + waiting[:, None]
    best = prices[-1]
    at = np.full(new.shape[1], len(waiting) - 1)
    for point in range(len(waiting) - 2, -1, -1):
        shares = calibrating[point]
        model = KernelRidge(kernel="rbf").fit(shares, prices[point] - best)
        best = np.where(model.predict(shares) <= 0.0, prices[point], best)
        at[model.predict(new[point]) <= 0.0] = point
    return at


def calimera(X, labels, folds):
    """CALIMERA at each decision point, X (points, n, p), a row for each of
    `WAITING`."""
    stops = np.empty((len(WAITING), len(labels)), dtype=np.int64)
    right = np.empty(X.shape[:2], dtype=bool)
    ridge = make_pipeline(StandardScaler(), RidgeClassifier(alpha=10.0))
    model = CalibratedClassifierCV(ridge, cv=2)
    for fold in range(FOLDS):
        test = folds == fold
        calibrating = []
        new = []
        for point, vectors in enumerate(X):
            train = vectors[~test], labels[~test]
            options = {"cv": 3, "method": "predict_proba"}
            calibrating.append(cross_val_predict(model, *train, **options))
            new.append(model.fit(*train).predict_proba(vectors[test]))
            right[point, test] = model.classes_[new[-1].argmax(axis=1)] == labels[test]
        for i, price in enumerate(WAITING):
            waiting = price * SECONDS / SECONDS[-1]
            stops[i, test] = halts(calibrating, new, waiting)
    return [decided(at, right) for at in stops]


def peers(by_set, labels, folds):
    """{peer: its curves on a task, one for each set of features}."""
    trees = [extra_trees(X, labels, folds) for X in by_set]
    return {
        TREES_FIXED: [of_set.fixed for of_set in trees],
        "extra trees": [of_set.curve() for of_set in trees],
        "CALIMERA": [calimera(X, labels, folds) for X in by_set],
        CHOSEN: [of_chosen_set(trees, folds)],
    }


def at(curves, seconds):
    """The least percentage wrong of some curves at a mean time, interpolated; NaN
    before the soonest decision."""
    percentages = []
    for curve in curves:
        times, wrong = zip(*sorted(curve), strict=True)
        percentages.append(100.0 * np.interp(seconds, times, wrong, left=np.nan))
    return np.fmin.reduce(percentages)


def cell(percentage):
    """A percentage for a table; a dash where it is NaN."""
    return "-" if np.isnan(percentage) else f"{percentage:.1f}"


def our_curves(ours):
    """Our curves of fixed windows, and of stopping when sure at each threshold."""
    fixed = list(zip(SECONDS, 1.0 - ours.right.mean(axis=1), strict=True))
    sure = []
    for threshold in (NEVER, *THRESHOLDS.tolist()):
        rule = StoppingRule(1.0, 0.0, threshold, len(SECONDS) - 1)
        stops, wrong = ours.course.under(rule)
        sure.append((SECONDS[stops].mean(), wrong.mean()))
    return {FIXED: [fixed], SURE: [sure]}


def judge(data, quick, jobs):
    """{task: {fixed window, when sure, or peer: its curves, one for each set of
    features}} of a data set."""
    dataset = followed(read([data]), NAMES, quick=quick)
    y = {task: dataset.labels(task) for task in dataset.tasks}
    folds = stratified_folds(y[finest(y)], FOLDS)
    by_set = []
    for sets in SETS:
        names = expand(sets.split())
        vectors = [dataset.features(s, SAMPLES, names) for s in DECISION_POINTS_S]
        by_set.append(np.stack(vectors))
    compared = compare_stopping(dataset, DECISION_POINTS_S, quick=quick, jobs=jobs)
    cases = [(by_set, y[task], folds) for task in compared]
    rivals = Workers(jobs).map("peers", peers, cases)
    curves = {}
    for (task, ours), theirs in zip(compared.items(), rivals, strict=True):
        curves[task] = our_curves(ours) | theirs
    return curves


def measure(data, quick, jobs):
    """Measure; print and write the table."""
    sets = [judge(folder, quick, jobs) for folder in data]
    rows = []
    for task in sets[0]:
        curves = [of_set[task] for of_set in sets if task in of_set]
        for seconds in DECISION_POINTS_S:
            row = {"task": task, "mean time, s": f"{seconds:.1f}"}
            rows.append(row | compare(curves, seconds))
    tables.write("stopping", [rows])


def compare(curves, seconds):
    """Percentages wrong at a mean time, as means over the data sets: fixed window, when
    sure, and the peers; and differences with their standard errors."""
    wrong = {
        name: np.array([at(of_set[name], seconds) for of_set in curves])
        for name in (FIXED, TREES_FIXED, SURE, *PEERS, CHOSEN)
    }
    means = {name: of_sets.mean() for name, of_sets in wrong.items()}
    best = min(PEERS, key=lambda name: np.nan_to_num(means[name], nan=np.inf))
    row = {name: cell(means[name]) for name in (FIXED, TREES_FIXED, SURE)}
    row["gain"] = difference(wrong[FIXED] - wrong[SURE])
    row |= {name: cell(means[name]) for name in PEERS}
    row["best of these less when sure"] = difference(wrong[best] - wrong[SURE])
    row[CHOSEN] = cell(means[CHOSEN])
    row["these less when sure"] = difference(wrong[CHOSEN] - wrong[SURE])
    return row


def difference(percentages):
    """The mean of differences over the data sets, with its standard error where there
    are several."""
    mean = percentages.mean()
    if np.isnan(mean):
        return "-"
    return f"{mean:+.1f}" + (
        f" ± {sem(percentages):.1f}" if len(percentages) > 1 else ""
    )


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--data", list, "folders of recordings, each a data set"),
        ("--quick", False, "the settings of a quick export"),
        ("--jobs", 2, "processes"),
    )
