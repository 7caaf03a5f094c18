"""`make stopping`: deciding when sure beside fixed windows, two points in a row, and TEASER.

All on the same five folds. TEASER (Schäfer and Leser, TEASER: early and accurate time series
classification, 2020) is aeon's, on the paper's three features as series, with its own classifier
and the rule that it finds by itself; it is left out where aeon is not installed
(`pip install aeon`). The rules of one row have the same mean time: their curves are interpolated.
The gain is how much less deciding when sure errs than the fixed window, with the standard error of
two independent shares (those of the same trials differ by less).
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.cli import dispatch
from edge.touch.feature_sets import expand
from edge.touch.features import FEATURES, SAMPLES
from train.dataset import load_trials
from train.evaluate import stratified_folds
from train.stopping import THRESHOLDS, finest
from train.tradeoff.early import FOLDS, Chooser, StoppingComparison, compare_stopping
from train.tradeoff.run import DECISION_POINTS_S, GRIDS, NAMES


def in_a_row(found: StoppingComparison) -> list[tuple[float, float]]:
    """(mean seconds, share wrong) of waiting for two decision points sure of the same label."""
    every, seconds = np.arange(found.trials), np.array(found.decision_points_s)
    same = np.zeros(found.right.shape, dtype=bool)
    same[1:] = found.labels[1:] == found.labels[:-1]
    rows = []
    for threshold in THRESHOLDS:
        sure = found.confidence >= threshold
        both = sure & same
        both[1:] &= sure[:-1]
        both[-1] = True
        at = both.argmax(axis=0)
        rows.append((float(seconds[at].mean()), 1.0 - float(found.right[at, every].mean())))
    return rows


def teaser(
    series: NDArray[np.float64], labels: NDArray[np.str_], folds: NDArray[np.int64], jobs: int
) -> tuple[float, float]:
    """(mean seconds, share wrong) of aeon's TEASER on series (n, features, samples)."""
    module = importlib.import_module("aeon.classification.early_classification")
    looks = DECISION_POINTS_S[::2]  # half as many, as its classifiers are slow
    points = [round(s / looks[-1] * (SAMPLES - 1)) + 1 for s in looks]
    seconds, wrong = [], []
    for fold in range(FOLDS):
        own = folds == fold
        model: Any = module.TEASER(classification_points=points, n_jobs=jobs, random_state=0)
        model.fit(series[~own], labels[~own])
        named, lengths = np.empty(own.sum(), dtype=labels.dtype), np.zeros(own.sum(), dtype=int)
        waiting = np.arange(own.sum())
        for at, point in enumerate(points):
            part = series[own][waiting][:, :, :point]
            ask = model.predict if at == 0 else model.update_predict
            said, done = ask(part)
            named[waiting[done]], lengths[waiting[done]] = said[done], at
            waiting = waiting[~np.asarray(done)]
            if not len(waiting):
                break
        seconds += [looks[at] for at in lengths]
        wrong += (named != labels[own]).tolist()
    return float(np.mean(seconds)), float(np.mean(wrong))


def at(rows: Sequence[tuple[float, float]], seconds: float) -> float:
    """The share wrong at a mean time, interpolated; NaN before the soonest decision."""
    times, wrong = zip(*sorted(rows), strict=True)
    return float(np.interp(seconds, times, wrong, left=np.nan))


def run(arguments: argparse.Namespace) -> int:
    """Measure and print the table."""
    dataset = load_trials(arguments.data, horizon_s=DECISION_POINTS_S[-1], features=NAMES)
    n = len(dataset.trials)
    rows = np.sort(np.random.default_rng(0).permutation(n)[: arguments.trials or n])
    y = {task: dataset.labels(task)[rows] for task in dataset.tasks}
    X = np.stack([dataset.features(s, SAMPLES, NAMES) for s in DECISION_POINTS_S])[:, rows]
    columns = dataset.widths(SAMPLES)
    choose = Chooser(X[-1], y, GRIDS, dataset.names, columns)
    compared = compare_stopping(
        X, y, DECISION_POINTS_S, dataset.names, choose, widths=columns, jobs=arguments.jobs
    )
    paper = dataset.features(DECISION_POINTS_S[-1], SAMPLES, expand(["paper"]))[rows]
    series = paper.reshape(len(rows), len(FEATURES), SAMPLES)
    head = "task", "mean time, s", "fixed window, % wrong", "when sure", "gain", "two in a row"
    print(f"| {' | '.join(head)} | TEASER |")
    print("|---|---|---|---|---|---|---|")
    for task, found in compared.items():
        if arguments.task and task not in arguments.task:
            continue
        fixed = list(zip(found.decision_points_s, found.fixed.tolist(), strict=True))
        sure = [(seconds, wrong) for _, seconds, wrong in found.when_sure()]
        twice = in_a_row(found)
        theirs: dict[float, str] = {}
        if importlib.util.find_spec("aeon") is not None:
            seconds, wrong = teaser(series, y[task], stratified_folds(y[finest(y)], FOLDS), 1)
            theirs = {seconds: f"{100 * wrong:.1f}"}
        for seconds in sorted({*DECISION_POINTS_S, *theirs}):
            waited, stopped, both = (at(way, seconds) for way in (fixed, sure, twice))
            error = np.sqrt((waited * (1 - waited) + stopped * (1 - stopped)) / found.trials)
            gain = f"{100 * (waited - stopped):.1f} ± {100 * error:.1f}"
            print(
                f"| {task} | {seconds:.2f} | {100 * waited:.1f} | {100 * stopped:.1f} | {gain} | "
                f"{'' if np.isnan(both) else f'{100 * both:.1f}'} | {theirs.get(seconds, '')} |"
            )
    for task, found in compared.items():
        for one in found.certified:
            if one.folds:
                print(
                    f"{task}, asked for {one.asked:g}: certified in {one.folds} of {FOLDS} folds, "
                    f"{100 * one.wrong:.1f} % wrong ({100 * one.unknown:.1f} % unknown) at "
                    f"{one.mean_s:.2f} s"
                )
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="bench.stopping", description=__doc__)
    top.add_argument("--data", nargs="+", required=True, metavar="REC", help=".npz or folders")
    top.add_argument("--trials", type=int, help="drawn from them (all)")
    top.add_argument("--task", nargs="+", help="only these")
    top.add_argument("--jobs", type=int, default=2, help="processes (%(default)s)")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
