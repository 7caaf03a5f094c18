"""`make risk`: how often a promise is broken, over many simulated data sets.

Trials of fresh seeds are simulated, the trials of several data sets in a batch. Each
data set is drawn from them and fitted as an export would fit it, with the choice of
features,
projection and neighbours. Its promises are judged on all trials that were not drawn:
these have streams of their own, as those of another seed have.

A certified error may be exceeded in one data set of ten (`train.model.rules.RISK`),
counted over all sets, also those whose request was refused. Of the few sets that
certify an error close to the lowest that the trials can reach, more than a tenth exceed
it, because only lucky sets certify it. The row "the smallest" counts the smallest error
that each set certifies. A set is late where it decides `LATE_S` later on average than
promised.

A point of the front (`make export FRONT=`) is a choice at a window, with an interval of
its nested accuracy. The row "export" has the interval that an export at the full window
prints. The accuracy on other trials may lie outside it in one data set of twenty.

The last table judges the confidence at the full window on new trials of known objects:
its calibration error, and how many of them are flagged `unknown`, where 1.25 % are
asked for. Further rows are of data sets that are exported in full but for four objects,
others in each: the board's own classifier decides on fresh touches of the others, and
of the four that it never met.
"""

import tempfile
from collections.abc import Mapping
from copy import deepcopy
from dataclasses import asdict, dataclass, replace
from itertools import chain

import numpy as np
import pandas as pd
from joblib import cpu_count
from numpy.typing import NDArray
from scipy.stats import binom

from edge.decide.early import fastest
from edge.features.vector import SAMPLES, WINDOW_S
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.checks.bench.shifts import (
    FRESH_SEED,
    SCENE,
    decisions,
    exported,
    fresh_touches,
)
from train.choose.candidates import candidates
from train.choose.options import FitOptions
from train.data.dataset import DataSet, Measurement, load_trials
from train.data.feature_sets import expand
from train.data.parts import part
from train.fitting import fit
from train.model.held_out import answers
from train.model.limits import beyond
from train.model.rules import RISK
from train.report.work import Workers
from train.simulate import scene as scenes
from train.simulate.run import write
from train.tradeoff.front import NAMES, ParetoFront

NEVER_MET = 4
"""Objects that a full export does not meet, others for each seed."""
POINTS_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
ERRORS = (0.05, 0.1, 0.2)
LATE_S = 0.05
OUTSIDE = 0.05
"""Share of the data sets whose accuracy may lie outside the interval of the front."""
BINS = 10
SEEDS = 5
COUNT = 20
FRESH = 10
TRIALS = 140
"""Batches, each of a seed of its own; trials of each object and condition in a
batch, and of the touches that judge full exports; trials of a data set."""


@dataclass(frozen=True, kw_only=True)
class DrawnSet(DataSet):
    """A data set of trials drawn from a pool, whose vectors are measured once for all
    sets.

    Attributes:
        rows: (n,) of its trials in the pool.
        pool: (windows, trials, p) vectors of the pool's trials at each of `POINTS_S`.
        columns: {feature: its columns in the vectors}.
    """

    rows: NDArray[np.int64]
    pool: NDArray[np.float64]
    columns: Mapping[str, NDArray[np.int64]]

    def pooled(self, windows_s, rows, names):
        """(windows, m, features * samples) vectors of some rows of the pool."""
        columns = np.concatenate([self.columns[name] for name in names])
        return np.stack(
            [
                self.pool[POINTS_S.index(round(w, 6))][rows[:, None], columns]
                for w in windows_s
            ]
        )

    def features(self, window_s=WINDOW_S, samples=SAMPLES, names=None):
        """(n, features * samples) vectors at one of `POINTS_S`."""
        return self.pooled([window_s], self.rows, names or self.names)[0]

    def with_kernels(self, window_s):
        """The same, as the pool's vectors have the tables of its first batch, in which
        no label took part."""
        return self


def simulated(seed, kernels=None):
    """A batch's trials without their frames, and their vectors (windows, n, p), by
    tables of kernels; those of its trials where None."""
    choices = candidates({}, FitOptions(), joints=True)
    names = [name for candidate in choices for name in candidate.sets]
    with tempfile.TemporaryDirectory() as folder:
        write(scenes.load(SCENE, seed=seed, count=COUNT), folder)
        measurement = Measurement(expand(names), horizon_s=POINTS_S[-1])
        dataset = load_trials([folder], measurement)
    if kernels is None:
        dataset = dataset.with_kernels(WINDOW_S)
    else:
        dataset = replace(dataset, kernels=kernels)
    trials = []
    for trial in dataset.trials:
        ends = part(trial.recording, slice(None, None, len(trial.recording.t) - 1))
        trials.append(replace(trial, recording=replace(ends, joints=None)))
    X = np.stack([dataset.features(window) for window in POINTS_S])
    # A copy in memory: the temporary files end with this process.
    return deepcopy(replace(dataset, trials=tuple(trials))), X


def judged(drawn, labels):
    """Fit a data set, and judge its promises on the trials that were not drawn.

    Args:
        drawn: the data set.
        labels: (tasks, trials) of the pool.

    Returns:
        Rows of `certificates`, of `front_points` and of `trust` at the full window, for
        each task.
    """
    rest = np.setdiff1d(np.arange(labels.shape[1]), drawn.rows)
    y = dict(zip(drawn.tasks, labels[:, rest], strict=True))
    points = {}
    right = {}
    for window in POINTS_S:
        decided = POINTS_S if window == WINDOW_S else ()
        fitted = fit(
            drawn,
            window_s=window,
            decision_points_s=decided,
            jobs=1,
        )
        vectors = drawn.pooled([window], rest, fitted.dataset.names)
        answered = answers([fitted.classifier], vectors)
        points[window] = fitted.chosen
        for task in y:
            right[task, window] = (answered[task][0][0] == y[task]).mean()
    model = fitted.sequential
    new = drawn.pooled(POINTS_S, rest, fitted.dataset.names)
    hits, confidences, series = model.judged(new, y)
    unknown = beyond(
        model.known_distance_.limits, model.space_.scores(new).known_distance
    )[-1]
    certified = []
    fronts = []
    trusted = []
    for task in y:
        certified += certificates(task, model.stopping_[task], series[task])
        fronts += front_points(task, points, right)
        doubts = trust(hits[task][-1], confidences[task][-1], unknown)
        trusted.append({"task": task, **doubts})
    return certified, fronts, trusted


def certificates(task, stopping, time_series):
    """A row for each request: the certified error, the share wrong, and the promised
    and the realised mean seconds, which are missing where the request is refused. The
    first request is the smallest error that is certified."""
    requests = {"the smallest": stopping.rules[0].error}
    requests |= {f"{error:g}": error for error in ERRORS}
    for name, error in requests.items():
        row = {"task": task, "asked": name, "error": error}
        row |= dict.fromkeys(("wrong", "promised, s", "realised, s"), np.nan)
        rule = fastest(stopping, error)
        if rule is not None:
            at, wrong = time_series.under(rule)
            row["wrong"] = wrong.mean()
            row["promised, s"] = rule.mean_s
            row["realised, s"] = np.take(POINTS_S, at).mean()
        yield row


def front_points(task, points, right):
    """A row for each point of the front and for the export: its window, its accuracy,
    the ends of its interval, and the realised accuracy."""
    front = ParetoFront.of(points, task)
    export = front.of({WINDOW_S: points[WINDOW_S]}, task).points
    picked = [*map(front.pick, NAMES), *export]
    for name, point in zip((*NAMES, "export"), picked, strict=True):
        realised = right[task, point.window_s]
        yield {"task": task, "front": name, **asdict(point), "realised": realised}


def trust(right, confidence, unknown):
    """Of new trials of known objects (m,): their mean confidence, the share that is
    right, the expected calibration error in ten ranges, and the shares that are wrong
    though sure, and that count as unknown."""
    ranges = np.minimum((confidence * BINS).astype(int), BINS - 1)
    gaps = np.bincount(ranges, confidence - right)
    return {
        "mean confidence": confidence.mean(),
        "right": right.mean(),
        "calibration error": np.abs(gaps).sum() / len(right),
        "wrong and over 0.9": ((confidence > 0.9) & ~right).mean(),
        "flagged unknown": unknown.mean(),
    }


def without_objects(seed):
    """The model of a full export of a seed's data set without some objects, and the
    names of these."""
    scene = scenes.load(SCENE, seed=seed)
    items = np.random.default_rng(seed).permutation(scene.objects)
    with tempfile.TemporaryDirectory() as folder:
        write(replace(scene, objects=tuple(items[NEVER_MET:])), folder)
        return exported(folder, jobs=1), [item.name for item in items[:NEVER_MET]]


def fully_exported(seed):
    """Rows of `trust` for each task of a full export of a seed's data set without some
    objects, on fresh touches of the others and of these; an unknown one is answered
    wrongly, with no confidence."""
    model, left_out = without_objects(seed)
    fresh = fresh_touches(scenes.load(SCENE, seed=FRESH_SEED, count=FRESH))
    rows = decisions(model, fresh).drop_duplicates(["task", "touch"])
    rows["unknown"] = ["unknown" in flags for flags in rows["flags"]]
    rows["right"] = rows["label"] == rows["truth"]
    rows["new"] = [fresh[i].labels["object"] in left_out for i in rows["touch"]]
    return [
        {"task": f"{task}, {'never met' if new else 'full export'}"}
        | trust(of["right"], of["confidence"], of["unknown"])
        for (task, new), of in rows.groupby(["task", "new"], sort=False)
    ]


def drawn_sets(batches, count):
    """The arguments of `judged` for data sets drawn from the trials of all batches."""
    pool = np.array([t for batch, _ in batches for t in batch.trials], dtype=object)
    X = np.concatenate([vectors for _, vectors in batches], axis=1)
    first, _ = batches[0]
    y = np.array([[trial.labels[task] for trial in pool] for task in first.tasks])
    ends = np.cumsum(first.widths())
    columns = np.split(np.arange(ends[-1]), ends[:-1])
    shared = {"pool": X, "columns": dict(zip(first.names, columns, strict=True))}
    rng = np.random.default_rng(0)
    cases = []
    for _ in range(count):
        rows = np.sort(rng.permutation(len(pool))[:TRIALS])
        fields = {**vars(first), "trials": tuple(pool[rows])}
        cases.append((DrawnSet(**fields, rows=rows, **shared), y))
    return cases


def measure(sets, exports):
    """Simulate, fit, count; 1 where a promise is broken more often than chance
    explains."""
    workers = Workers(cpu_count())
    first = simulated(0)
    others = [(seed, first[0].kernels) for seed in range(1, SEEDS)]
    batches = [first, *workers.map("batches of trials", simulated, others)]
    results = workers.map("data sets", judged, drawn_sets(batches, sets))
    certified, fronts, trusted = map(chain.from_iterable, zip(*results, strict=True))
    full = workers.map("full exports", fully_exported, [(s,) for s in range(exports)])
    trusted = [*trusted, *chain.from_iterable(full)]
    certified = summed_up(certified, ["task", "asked"], certificate)
    fronts = summed_up(fronts, ["task", "front"], interval)
    trusted = summed_up(trusted, ["task"], confidence)
    tables.write("risk", [certified, fronts, trusted])
    above = np.array([row["above"] for row in certified])
    outside = np.array([row["below the interval"] + row["above it"] for row in fronts])
    most_above, most_outside = binom.ppf(0.99, sets, (RISK, OUTSIDE))
    return int(any(above > most_above) or any(outside > most_outside))


def summed_up(rows, keys, summary):
    """A row for each group of rows, in the order in which the groups first come."""
    groups = pd.DataFrame(rows).groupby(keys, sort=False)
    return [dict(zip(keys, key, strict=True)) | summary(of) for key, of in groups]


def certificate(rows):
    """How often a requested error is certified, exceeded and late."""
    able = rows.dropna()
    row = {"sets": len(rows), "certified": len(able)}
    row["above"] = int((able["wrong"] > able["error"]).sum())
    forms = {"wrong": ".1%", "promised, s": ".2f", "realised, s": ".2f"}
    for name, form in forms.items():
        row[name] = format(able[name].mean(), form) if len(able) else ""
    row["late"] = int((able["realised, s"] > able["promised, s"] + LATE_S).sum())
    return row


def interval(rows):
    """How often the accuracy lies outside the interval of a point of the front."""
    return {
        "window, s": f"{rows['window_s'].mean():.2f}",
        "shown": f"{rows['accuracy'].mean():.1%}",
        "realised": f"{rows['realised'].mean():.1%}",
        "below the interval": int((rows["realised"] < rows["low"]).sum()),
        "above it": int((rows["realised"] > rows["high"]).sum()),
    }


def confidence(rows):
    """Means of what the confidence was worth."""
    means = rows.drop(columns="task").mean()
    row = {"sets": len(rows)}
    return row | {name: f"{mean:.3f}" for name, mean in means.items()}


if __name__ == "__main__":
    start(
        measure,
        __doc__,
        ("--sets", 20, "data sets drawn"),
        ("--exports", 4, "further data sets, exported in full"),
    )
