"""`make risk`: how often a certified error rate is exceeded, over many simulated data sets.

A large set is simulated and measured once. Data sets of the requested size are drawn from it. Each
is fitted as an export would fit it, with the choice of features, projection and neighbours, and the
error of its decisions is counted on all trials that were not drawn.

A certificate may fail in one data set of ten (`train.stopping.RISK`), counted over all sets, also
those whose request was refused. Of the few sets that certify an error close to the lowest that the
trials can reach, more than a tenth exceed it, because only lucky sets certify it.

The row "the smallest" counts the smallest error that each set certifies.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.stats import binom
from threadpoolctl import threadpool_limits

from edge.cli import dispatch
from edge.touch.feature_sets import expand
from edge.touch.features import SAMPLES, WINDOW_S
from train.choose import candidates
from train.dataset import DataSet, load_trials
from train.fitting import fit
from train.progress import bar as progress_bar
from train.simulate import scene as scenes
from train.simulate.run import total_trials, write
from train.stopping import RISK, answers, confidences, stops, withheld

SCENE = Path(__file__).parents[1] / "train" / "scenes" / "cody18.toml"
TASKS = ("category", "mobility", "object")
POINTS_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
ERRORS = (0.05, 0.1, 0.2)
POOL = 50
"""Trials of each object and condition in the large set."""


@dataclass(frozen=True)
class Drawn(DataSet):
    """Trials of a large set whose vectors were measured once.

    Attributes:
        vectors: {window: (all trials, p)}.
        columns: {feature: its columns}.
        rows: indices of these trials among all.
    """

    vectors: Mapping[float, NDArray[np.float64]]
    columns: Mapping[str, NDArray[np.int64]]
    rows: NDArray[np.int64]

    def features(
        self, window_s: float = WINDOW_S, samples: int = SAMPLES, names: Sequence[str] | None = None
    ) -> NDArray[np.float64]:
        """As `DataSet.features`."""
        names = self.names if names is None else names
        columns = np.concatenate([self.columns[name] for name in names])
        return np.asarray(self.vectors[window_s][self.rows[:, None], columns])

    def some(self, rows: NDArray[np.int64]) -> Drawn:
        """The trials of these rows."""
        return replace(self, trials=tuple(self.trials[i] for i in rows), rows=self.rows[rows])


def measured(dataset: DataSet) -> Drawn:
    """All trials of a data set, measured at `POINTS_S`; frames are dropped to save memory."""
    widths = dataset.widths(SAMPLES)
    parts = np.split(np.arange(sum(widths)), np.cumsum(widths)[:-1])
    trials = []
    for trial in dataset.trials:
        full, series = trial.recording, trial.series.thinned(len(trial.series.t))
        ends = replace(full, t=full.t[[0, -1]], frames=full.frames[[0, -1]], joints=None)
        trials.append(replace(trial, recording=ends, series=series))
    return Drawn(
        **{**vars(dataset), "trials": tuple(trials)},
        vectors={window: dataset.features(window, SAMPLES) for window in POINTS_S},
        columns=dict(zip(dataset.names, parts, strict=True)),
        rows=np.arange(len(trials)),
    )


def realised(pool: Drawn, rows: NDArray[np.int64]) -> NDArray[np.float64]:
    """(tasks, 1 + errors, 3): requested error, share wrong, mean seconds; NaN where refused.

    The first request of each task is the smallest error that is certified.
    """
    others = pool.some(np.setdiff1d(np.arange(len(pool.trials)), rows))
    fitted = fit(pool.some(rows), tasks=TASKS, decision_points_s=POINTS_S, quick=True, jobs=1)
    model = fitted.sequential
    assert model is not None
    X = np.stack([others.features(s, SAMPLES, fitted.dataset.names) for s in POINTS_S])
    every, seconds = np.arange(X.shape[1]), np.array(POINTS_S)
    outcomes = np.full((len(TASKS), 1 + len(ERRORS), 3), np.nan)
    for task, out in zip(TASKS, outcomes, strict=True):
        with threadpool_limits(1):
            named, margins, distances = answers(model.decision_points_, task, X)
        stopping = model.stopping_[task]
        confidence = confidences(stopping.slopes, stopping.intercepts, margins)
        wrong = (named != others.labels(task)) | withheld(model.novelty_, task, distances)
        for place, error in zip(out, (stopping.smallest_error, *ERRORS), strict=True):
            rule = stopping.rule(error)
            if rule is not None:
                at = stops(confidence, rule)
                place[:] = error, wrong[at, every].mean(), seconds[at].mean()
    return outcomes


def run(arguments: argparse.Namespace) -> int:
    """Simulate, draw, count; 1 where a certificate fails more often than chance explains."""
    features = [
        name for candidate in candidates({}, joints=True, quick=True) for name in candidate.sets
    ]
    with tempfile.TemporaryDirectory() as folder:
        scene = scenes.load(SCENE, count=POOL)
        with progress_bar(total=total_trials(scene), desc="simulating", unit=" trials") as bar:
            write(scene, folder, jobs=arguments.jobs, progress=bar.update)
        dataset = load_trials(
            [folder], features=expand(features), horizon_s=POINTS_S[-1], progress=True
        )
        pool = measured(dataset)
    rng = np.random.default_rng(arguments.seed)
    n = len(pool.trials)
    draws = [np.sort(rng.permutation(n)[: arguments.trials]) for _ in range(arguments.sets)]
    work = (delayed(realised)(pool, rows) for rows in draws)
    parts = Parallel(n_jobs=arguments.jobs, return_as="generator")(work)
    outcomes = np.array(list(progress_bar(parts, total=len(draws), desc="data sets")))
    allowed = int(binom.ppf(0.99, len(draws), RISK))
    failed = 0
    print("| task | asked | certified | of all sets, above | wrong on average | mean time, s |")
    print("|---|---|---|---|---|---|")
    names = ("the smallest", *(f"{error:g}" for error in ERRORS))
    for task, of_task in zip(TASKS, outcomes.swapaxes(0, 1), strict=True):
        for asked, rows in zip(names, of_task.swapaxes(0, 1), strict=True):
            able = rows[~np.isnan(rows[:, 1])]
            above = int((able[:, 1] > able[:, 0]).sum())
            failed += above > allowed
            means = f"{able[:, 1].mean():.1%} | {able[:, 2].mean():.2f}" if len(able) else " | "
            print(
                f"| {task} | {asked} | {len(able)} of {len(draws)} | "
                f"{above} ({above / len(draws):.1%}) | {means} |"
            )
    return int(failed > 0)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="bench.risk", description=__doc__)
    top.add_argument("--sets", type=int, default=200, help="data sets drawn (%(default)s)")
    top.add_argument("--trials", type=int, default=140, help="trials of each (%(default)s)")
    top.add_argument("--seed", type=int, default=0)
    top.add_argument("--jobs", type=int, default=2, help="processes (%(default)s)")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
