"""`make risk`: how often a certified error rate is exceeded, over many simulated data sets.

One large set is simulated. Data sets of the size asked for are drawn from it, each is fitted and
calibrated as an export would, and the error of its decisions is counted on all trials that were
not drawn. A certificate may fail in one set of ten (`train.stopping.RISK`).
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.stats import binom
from threadpoolctl import threadpool_limits
from tqdm import tqdm

from edge.cli import dispatch
from edge.model.stopping import NOVELTY_RATE
from edge.touch.feature_sets import SETS
from train.dataset import load_trials
from train.pipeline import Choice
from train.simulate import scene as scenes
from train.simulate.run import total_trials, write
from train.stopping import RISK, SequentialClassifier, answers, confidences, stops

SCENE = Path(__file__).parents[1] / "train" / "scenes" / "cody18.toml"
NAMES = SETS["contact"].features
POINTS_S = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
SAMPLES = 20
ERRORS = (0.05, 0.1, 0.2)
CHOICE = Choice("IV", 20, 3, "lda", 0.03)
"""The same for every set: what is certified here is the stopping, not the choice."""
POOL = 50
"""Trials of each object and condition in the large set."""


def realised(
    X: NDArray[np.float64],
    labels: NDArray[np.str_],
    rows: NDArray[np.int64],
    widths: tuple[int, ...],
) -> list[tuple[float, float]]:
    """(share wrong, mean seconds) at each of `ERRORS`, trained on some rows; NaN if refused."""
    rest = np.setdiff1d(np.arange(len(labels)), rows)
    model = SequentialClassifier({"task": CHOICE}, POINTS_S, NAMES, widths=widths).fit(
        X[:, rows], {"task": labels[rows]}
    )
    with threadpool_limits(1):
        named, margins, distances = answers(model.decision_points_, "task", X[:, rest])
    stopping, seconds = model.stopping_["task"], np.array(POINTS_S)
    confidence = confidences(stopping.slopes, stopping.intercepts, margins)
    far = [[model.novelty_.rate(i, d) for d in row] for i, row in enumerate(distances.tolist())]
    wrong = (named != labels[rest]) | (np.array(far) <= NOVELTY_RATE)
    found = []
    for error in ERRORS:
        rule = stopping.rule(error)
        if rule is None:
            found.append((np.nan, np.nan))
            continue
        at = stops(confidence, rule)
        found.append((float(wrong[at, np.arange(len(rest))].mean()), float(seconds[at].mean())))
    return found


def run(arguments: argparse.Namespace) -> int:
    """Simulate, draw, count; 1 where a certificate fails more often than chance explains."""
    with tempfile.TemporaryDirectory() as folder:
        scene = scenes.load(SCENE, count=POOL)
        with tqdm(total=total_trials(scene), desc="simulating", unit=" trials") as bar:
            write(scene, folder, jobs=arguments.jobs, progress=bar.update)
        dataset = load_trials([folder], features=NAMES, horizon_s=POINTS_S[-1], progress=True)
    X = np.stack([dataset.features(window, SAMPLES) for window in POINTS_S])
    labels = dataset.labels(arguments.task)
    rng = np.random.default_rng(arguments.seed)
    draws = [
        np.sort(rng.permutation(len(labels))[: arguments.trials]) for _ in range(arguments.sets)
    ]
    work = (delayed(realised)(X, labels, rows, dataset.widths(SAMPLES)) for rows in draws)
    parts = Parallel(n_jobs=arguments.jobs, return_as="generator")(work)
    found = np.array(list(tqdm(parts, total=len(draws), desc="data sets")))
    allowed = int(binom.ppf(0.99, len(draws), RISK))
    failed = 0
    print("asked  certified  wrong on average  above asked  mean time")
    for error, (wrong, seconds) in zip(ERRORS, found.transpose(1, 2, 0), strict=True):
        there = ~np.isnan(wrong)
        above = int((wrong[there] > error).sum())
        failed += above > allowed
        shown = f"{np.mean(wrong[there]):16.1%}" if there.any() else f"{'-':>16}"
        mean = f"{np.mean(seconds[there]):6.2f} s" if there.any() else "-"
        print(f"{error:5g} {there.mean():10.0%} {shown} {above / len(draws):12.1%}  {mean:>9}")
    return int(failed > 0)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="bench.risk", description=__doc__)
    top.add_argument("--sets", type=int, default=200, help="data sets drawn (%(default)s)")
    top.add_argument("--trials", type=int, default=140, help="trials of each (%(default)s)")
    top.add_argument("--task", default="category", help="of the scene (%(default)s)")
    top.add_argument("--seed", type=int, default=0)
    top.add_argument("--jobs", type=int, default=2, help="processes (%(default)s)")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
