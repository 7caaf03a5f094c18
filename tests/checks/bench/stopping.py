"""`make stopping`: deciding when sure beside fixed windows and beside extra trees.

All decide on the same five folds; ours has the settings of an export. Extra trees
decide at the first point at which their highest class probability passes a threshold.
They have four sets of features, joint angles among them, and the set that errs least at
the time is shown, which favours them. "set chosen" shows extra trees as a user could
have them: their set is chosen for the trials of each fold by those of the other folds,
as ours is. Columns are compared at the same mean time, between two thresholds by
interpolation, as means over the data sets. The gain is by how much deciding when sure
errs less than the fixed window. The other differences are by how much it errs less than
the trees, and than the trees whose set is chosen. Standard errors are those of the
paired differences over the data sets.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import sem
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_predict

from edge.decide.info import StoppingRule
from edge.features.vector import SAMPLES
from tests.checks.bench import tables
from tests.checks.bench.program import start
from train.choose.options import FitOptions
from train.data.dataset import Measurement, load_trials, read
from train.data.feature_sets import expand
from train.data.folds import finest, stratified_folds
from train.data.groups import TRIAL
from train.model.rules import NEVER, THRESHOLDS
from train.report.work import Workers
from train.tradeoff.choices import WINDOWS_S as DECISION_POINTS_S
from train.tradeoff.early import FOLDS, held_out_decisions
from train.tune import features_tried

SECONDS = np.array(DECISION_POINTS_S)
SETS = (
    "paper contact",
    "contact joints",
    "contact sqrt_joints",
    "contact moments joints",
)
"""The features of the extra trees."""
NAMES = tuple(dict.fromkeys(" ".join(SETS).split()))
FIXED = "fixed window, % wrong"
SURE = "when sure"
TREES = "extra trees"
CHOSEN = "extra trees, set chosen"


# A curve is [(mean seconds, share wrong)] at each threshold.


class Trees(NamedTuple):
    """What extra trees of one set of features cost when sure.

    Attributes:
        seconds, wrong: (thresholds, n) for each trial.
    """

    seconds: Any
    wrong: Any

    def curve(self, trials=slice(None)):
        """Their curve when sure, of some trials."""
        seconds = self.seconds[:, trials].mean(axis=1)
        return list(zip(seconds, self.wrong[:, trials].mean(axis=1), strict=True))


def extra_trees(X, labels, folds):
    """Extra trees of a set of features, X (points, n, p)."""
    model = ExtraTreesClassifier(random_state=0)
    options = {"cv": PredefinedSplit(folds), "method": "predict_proba"}
    shares = np.stack([cross_val_predict(model, x, labels, **options) for x in X])
    classes = np.unique(labels)
    right = classes[shares.argmax(axis=2)] == labels
    passed = shares.max(axis=2) >= THRESHOLDS[:, None, None]
    passed[:, -1] = True
    stops = passed.argmax(axis=1)
    wrong = ~right[stops, np.arange(len(labels))]
    return Trees(SECONDS[stops], wrong)


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
        chosen = Trees(taken_s, wrong)
        curve.append((seconds, at([chosen.curve()], seconds) / 100))
    return curve


def peers(by_set, labels, folds):
    """{peer: its curves on a task, one for each set of features}."""
    trees = [extra_trees(X, labels, folds) for X in by_set]
    return {
        TREES: [of_set.curve() for of_set in trees],
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
    # A label counts even where the contact is unlike all trained ones.
    ours = replace(ours, withheld=None)
    # A fixed window waits for none.
    hasty = replace(ours, unusual=np.zeros_like(ours.unusual))

    def decided(series, threshold, last):
        stops, wrong = series.under(StoppingRule(1.0, 0.0, threshold, last))
        return SECONDS[stops].mean(), wrong.mean()

    end = len(SECONDS) - 1
    fixed = [decided(hasty, NEVER, last) for last in range(len(SECONDS))]
    sure = [decided(ours, t, end) for t in (NEVER, *THRESHOLDS.tolist())]
    return {FIXED: [fixed], SURE: [sure]}


def judge(data, quick, jobs):
    """{task: {fixed window, when sure, or peer: its curves, one for each set of
    features}} of a data set."""
    recordings = read([data])
    tried = features_tried(recordings, FitOptions(quick=quick))
    measurement = Measurement(expand([*tried, *NAMES]), DECISION_POINTS_S[-1])
    dataset = load_trials(recordings, measurement)
    y = {task: dataset.labels(task) for task in dataset.tasks}
    folds = stratified_folds(y[finest(y)], FOLDS)
    by_set = []
    for sets in SETS:
        names = expand(sets.split())
        vectors = [dataset.features(s, SAMPLES, names) for s in DECISION_POINTS_S]
        by_set.append(np.stack(vectors))
    options = {
        "leave_out": TRIAL,
        "decision_points_s": DECISION_POINTS_S,
        "tasks": tuple(y),
        "quick": quick,
    }
    compared = held_out_decisions(dataset, folds, options, jobs)
    cases = [(by_set, y[task], folds) for task in compared]
    rivals = Workers(jobs).map("peers", peers, cases)
    curves = {}
    for (task, ours), theirs in zip(compared.items(), rivals, strict=True):
        curves[task] = our_curves(ours) | theirs
    return curves


def measure(data, quick, jobs):
    """Measure; print and write a file for each size of the data sets."""
    of_size = {}
    for folder in data:
        sets = of_size.setdefault(len([*Path(folder).rglob("*.npz")]), [])
        sets.append(judge(folder, quick, jobs))
    for trials, sets in of_size.items():
        tables.write(f"stopping_{trials}", [rows(trials, sets)])


def rows(trials, sets):
    """The rows of data sets of so many trials."""
    return [
        {"trials": trials, "task": task, "mean time, s": f"{seconds:.1f}"}
        | compare([of_set[task] for of_set in sets if task in of_set], seconds)
        for task in sets[0]
        for seconds in DECISION_POINTS_S
    ]


def compare(curves, seconds):
    """Percentages wrong at a mean time, as means over the data sets: fixed window, when
    sure, and the peers; and differences with their standard errors."""
    wrong = {
        name: np.array([at(of_set[name], seconds) for of_set in curves])
        for name in (FIXED, SURE, TREES, CHOSEN)
    }
    means = {name: of_sets.mean() for name, of_sets in wrong.items()}
    row = {name: cell(means[name]) for name in (FIXED, SURE)}
    row["gain"] = difference(wrong[FIXED] - wrong[SURE])
    for name in (TREES, CHOSEN):
        row[name] = cell(means[name])
        row[f"{name}, less when sure"] = difference(wrong[name] - wrong[SURE])
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
        (
            "--data",
            list,
            "folders of recordings, each a data set; those of one size share a table",
        ),
        ("--quick", False, "the settings of a quick export"),
        ("--jobs", 2, "processes"),
    )
