"""`make risk`: how often a promise is broken, over many simulated data sets.

Trials of fresh seeds are simulated, the trials of several data sets in a batch. Each
data set is drawn from them and fitted as a quick export would fit it, with the choice
of features, projection and neighbours. Its promises are judged on all trials that were
not drawn: these have streams of their own, as those of another seed have.

A certified error may be exceeded in one data set of ten (`train.rules.RISK`), counted
over all sets, also those whose request was refused. Of the few sets that certify an
error close to the lowest that the trials can reach, more than a tenth exceed it,
because only lucky sets certify it. The row "the smallest" counts the smallest error
that each set certifies. A set is late where it decides `LATE_S` later on average than
promised.

A point of the front (`make export FRONT=`) is a choice at a window, with an interval of
its nested accuracy. The row "export" has the interval that an export at the full window
prints. The accuracy on other trials may lie outside it in one data set of twenty.

The last table judges the confidence at the full window on new trials of known objects:
its calibration error, and how many of them are flagged `unknown` where 2 % are asked
for; in brackets, what four fifths of the sets give.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.stats import binom

from edge.cli import dispatch
from edge.commands.options import within
from edge.touch.features import SAMPLES, WINDOW_S
from tests.bench import tables
from train.candidates import candidates
from train.choose import Chosen
from train.dataset import DataSet, load_trials
from train.feature_sets import expand
from train.fitting import fit
from train.progress import bar
from train.rules import RISK
from train.simulate import scene as scenes
from train.simulate.run import write
from train.stopping import answers, unlike
from train.tradeoff.front import NAMES, ParetoFront

SCENE = Path(__file__).parents[2] / "train" / "scenes" / "cody18.toml"
POINTS_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
ERRORS = (0.05, 0.1, 0.2)
LATE_S = 0.05
OUTSIDE = 0.05
"""Share of the data sets whose accuracy may lie outside the interval of the front."""
BINS = 10
SHOWN = (*NAMES, "export")
SEEDS = 5
COUNT = 20
"""Batches, each of a seed of its own; trials of each object and condition in a
batch."""


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

    def others(
        self, labels: NDArray[np.str_]
    ) -> tuple[NDArray[np.int64], dict[str, NDArray[np.str_]]]:
        """The rows of the pool that were not drawn, and their labels for each task."""
        rows = np.setdiff1d(np.arange(labels.shape[1]), self.rows)
        return rows, dict(zip(self.tasks, labels[:, rows], strict=True))

    def vectors(
        self, windows_s: Sequence[float], rows: NDArray[np.int64], names: Sequence[str]
    ) -> NDArray[np.float64]:
        """(windows, m, features * samples) vectors of some rows of the pool."""
        columns = np.concatenate([self.columns[name] for name in names])
        return np.stack(
            [self.pool[POINTS_S.index(w)][rows[:, None], columns] for w in windows_s]
        )

    def features(
        self,
        window_s: float = WINDOW_S,
        samples: int = SAMPLES,
        names: Sequence[str] | None = None,
    ) -> NDArray[np.float64]:
        """(n, features * samples) vectors at one of `POINTS_S`."""
        return self.vectors(
            [window_s], self.rows, self.names if names is None else names
        )[0]


def simulated(seed: int) -> tuple[DataSet, NDArray[np.float64]]:
    """A batch's trials without their frames, and their vectors (windows, n, p)."""
    names = [
        name for each in candidates({}, joints=True, quick=True) for name in each.sets
    ]
    with tempfile.TemporaryDirectory() as folder:
        write(replace(scenes.load(SCENE, count=COUNT), seed=seed), folder)
        dataset = load_trials([folder], features=expand(names), horizon_s=POINTS_S[-1])
    trials = []
    for trial in dataset.trials:
        full = trial.recording
        ends = replace(
            full, t=full.t[[0, -1]], frames=full.frames[[0, -1]], joints=None
        )
        trials.append(replace(trial, recording=ends))
    X = np.stack([dataset.features(window) for window in POINTS_S])
    return replace(dataset, trials=tuple(trials)), X


def judged(
    drawn: DrawnSet, labels: NDArray[np.str_]
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Fit a data set, and judge its promises on the trials that were not drawn.

    Args:
        drawn: the data set.
        labels: (tasks, trials) of the pool.

    Returns:
        (tasks, 1 + errors, 4) certified error, share wrong, promised and realised mean
        seconds, NaN where the request is refused; the first request is the smallest
        error that is certified. (tasks, `SHOWN`, 5) window, accuracy, its interval and
        the realised accuracy of each point of the front. (tasks, 5) of `trust` at the
        full window.
    """
    others, y = drawn.others(labels)
    points: dict[float, dict[str, Chosen]] = {}
    right: dict[float, dict[str, float]] = {}
    for window in POINTS_S:
        decided = POINTS_S if window == WINDOW_S else ()
        fitted = fit(
            drawn, window_s=window, decision_points_s=decided, quick=True, jobs=1
        )
        vectors = drawn.vectors([window], others, fitted.dataset.names)
        answered = answers([fitted.classifier], vectors)
        points[window] = fitted.chosen
        right[window] = {
            task: float((answered[task][0][0] == y[task]).mean()) for task in y
        }
    model = fitted.sequential
    seconds = np.array(POINTS_S)
    assert model is not None
    outcomes = np.full((len(y), 1 + len(ERRORS), 4), np.nan)
    new = drawn.vectors(POINTS_S, others, fitted.dataset.names)
    hits, confidences, courses = model.judged(new, y)
    unknown = unlike(model.novelty_, model.space_.scores(new))[-1]
    doubts = [trust(hits[task][-1], confidences[task][-1], unknown) for task in y]
    for task, out in zip(y, outcomes, strict=True):
        stopping = model.stopping_[task]
        for place, error in zip(out, (stopping.smallest_error, *ERRORS), strict=True):
            rule = stopping.rule(error)
            if rule is not None:
                at, wrong = courses[task].under(rule)
                place[:] = error, wrong.mean(), rule.mean_s, seconds[at].mean()
    fronts = []
    for task in y:
        front = ParetoFront.of(points, task)
        full = front.of({WINDOW_S: points[WINDOW_S]}, task).points
        for point in (*map(front.pick, NAMES), *full):
            realised = right[point.window_s][task]
            fronts.append(
                (point.window_s, point.accuracy, point.low, point.high, realised)
            )
    return outcomes, np.array(fronts).reshape(len(y), len(SHOWN), 5), np.array(doubts)


def trust(
    right: NDArray[np.bool_],
    confidence: NDArray[np.float64],
    unknown: NDArray[np.bool_],
) -> tuple[float, ...]:
    """Of new trials of known objects (m,): their mean confidence, the share that is
    right, the expected calibration error in ten ranges, the Brier score, and the share
    that counts as unknown."""
    ranges = np.minimum((confidence * BINS).astype(int), BINS - 1)
    gaps = np.bincount(ranges, confidence - right)
    return (
        float(confidence.mean()),
        float(right.mean()),
        float(np.abs(gaps).sum() / len(right)),
        float(((confidence - right) ** 2).mean()),
        float(unknown.mean()),
    )


def run(arguments: argparse.Namespace) -> int:
    """Simulate, fit, count; 1 where a promise is broken more often than chance
    explains."""

    def work(
        function: Callable[..., Any], cases: Sequence[Any], what: str
    ) -> list[Any]:
        done = Parallel(n_jobs=arguments.jobs, return_as="generator")(
            delayed(function)(*case) for case in cases
        )
        return list(bar(done, total=len(cases), desc=what))

    seeds = np.random.SeedSequence(arguments.seed).generate_state(SEEDS).tolist()
    batches = work(simulated, [(seed,) for seed in seeds], "batches of trials")
    trials = np.array(
        [trial for dataset, _ in batches for trial in dataset.trials], dtype=object
    )
    X = np.concatenate([x for _, x in batches], axis=1)
    first = batches[0][0]
    y = np.array([[trial.labels[task] for trial in trials] for task in first.tasks])
    rng = np.random.default_rng(arguments.seed)
    ends = np.cumsum(first.widths())
    columns = dict(
        zip(first.names, np.split(np.arange(ends[-1]), ends[:-1]), strict=True)
    )
    cases = []
    for _ in range(arguments.sets):
        rows = np.sort(rng.permutation(len(trials))[: arguments.trials])
        drawn = {**vars(first), "trials": tuple(trials[rows])}
        cases.append((DrawnSet(**drawn, rows=rows, pool=X, columns=columns), y))
    results = work(judged, cases, "data sets")
    outcomes, fronts, doubts = map(np.array, zip(*results, strict=True))
    return int(report(first.tasks, outcomes, fronts, doubts) > 0)


def report(
    tasks: Sequence[str],
    outcomes: NDArray[np.float64],
    fronts: NDArray[np.float64],
    doubts: NDArray[np.float64],
) -> int:
    """Print and write what `judged` gave; the number of promises broken too often."""
    certified = []
    shown = []
    failed = 0
    for task, of_task in zip(tasks, outcomes.swapaxes(0, 1), strict=True):
        names = ("the smallest", *(f"{error:g}" for error in ERRORS))
        for asked, rows in zip(names, of_task.swapaxes(0, 1), strict=True):
            row = certificate(rows)
            failed += row["above"] > binom.ppf(0.99, len(rows), RISK)
            certified.append({"task": task, "asked": asked, **row})
    for task, of_task in zip(tasks, fronts.swapaxes(0, 1), strict=True):
        for name, rows in zip(SHOWN, of_task.swapaxes(0, 1), strict=True):
            row = interval(rows)
            outside = row["below the interval"] + row["above it"]
            failed += outside > binom.ppf(0.99, len(rows), OUTSIDE)
            shown.append({"task": task, "front": name, **row})
    trusted = []
    for task, rows in zip(tasks, doubts.swapaxes(0, 1), strict=True):
        confidence, right, error, brier, flagged = rows.T
        low, high = np.quantile(flagged, (0.1, 0.9))
        trusted.append(
            {
                "task": task,
                "mean confidence": f"{confidence.mean():.3f}",
                "right": f"{right.mean():.3f}",
                "calibration error": f"{error.mean():.3f}",
                "Brier score": f"{brier.mean():.3f}",
                "flagged unknown": f"{flagged.mean():.1%} ({low:.1%} to {high:.1%})",
            }
        )
    tables.write("risk", [certified, shown, trusted])
    return failed


def certificate(rows: NDArray[np.float64]) -> dict[str, Any]:
    """How often a requested error (sets, 4) is certified, exceeded and late."""
    able = rows[~np.isnan(rows[:, 1])]
    row = {"sets": len(rows), "certified": len(able)}
    row["above"] = int((able[:, 1] > able[:, 0]).sum())
    row |= {"wrong": "", "promised, s": "", "realised, s": ""}
    if len(able):
        _, wrong, promised_s, mean_s = able.mean(axis=0)
        row["wrong"] = f"{wrong:.1%}"
        row["promised, s"] = f"{promised_s:.2f}"
        row["realised, s"] = f"{mean_s:.2f}"
    row["late"] = int((able[:, 3] > able[:, 2] + LATE_S).sum())
    return row


def interval(rows: NDArray[np.float64]) -> dict[str, Any]:
    """How often the accuracy lies outside the interval of a point of the front."""
    window, accuracy, low, high, realised = rows.T
    return {
        "window, s": f"{window.mean():.2f}",
        "shown": f"{accuracy.mean():.1%}",
        "realised": f"{realised.mean():.1%}",
        "below the interval": int((realised < low).sum()),
        "above it": int((realised > high).sum()),
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="tests.bench.risk", description=__doc__)
    count = within(int, 1, 1e5)
    top.add_argument(
        "--sets", type=count, default=140, help="data sets drawn (%(default)s)"
    )
    top.add_argument(
        "--trials", type=count, default=140, help="trials of each (%(default)s)"
    )
    top.add_argument("--seed", type=int, default=0)
    top.add_argument("--jobs", type=count, default=2, help="processes (%(default)s)")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
