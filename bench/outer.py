"""`python -m bench.outer`: the accuracy of what `make export` makes, on trials that it never saw.

The recordings are divided into five folds. The default export of the others decides each fold, so
the accuracy printed by an export can be compared with it. Touches in which the tracker finds no
contact count as wrong, or as right where nothing was touched.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from joblib import cpu_count

from edge.recording import save
from train.dataset import load_trials, read
from train.evaluate import Result, stratified_folds
from train.fitting import fit
from train.labels import NO_CONTACT
from train.report.score import interval

FOLDS = 5


def main() -> None:
    """Measure and print."""
    top = argparse.ArgumentParser(prog="bench.outer", description=__doc__)
    top.add_argument("data", nargs="+", metavar="REC", help=".npz or folders")
    top.add_argument("--task", default="object", help="task that is scored (%(default)s)")
    top.add_argument("--tactile", action="store_true", help="without joint angles")
    arguments = top.parse_args()
    raw = read(arguments.data)
    folds = stratified_folds(np.array([r.labels[arguments.task] for r in raw.recordings]), FOLDS)
    right = total = 0
    with tempfile.TemporaryDirectory() as folder:
        paths = [Path(folder) / f"{i}.npz" for i in range(len(raw.recordings))]
        for path, recording in zip(paths, raw.recordings, strict=True):
            save(path, replace(recording, joints=None) if arguments.tactile else recording)
        for fold in range(FOLDS):
            known, new = (
                [p for p, f in zip(paths, folds == fold, strict=True) if f == side]
                for side in (False, True)
            )
            fitted = fit(known, decision_points_s=(), jobs=cpu_count())
            layout, chosen = fitted.dataset.layout, fitted.chosen[arguments.task]
            asked = load_trials(
                new, threshold=layout.threshold_counts, onset=layout.onset,
                horizon_s=fitted.window_s, features=fitted.dataset.names,
            )  # fmt: skip
            asked = replace(asked, kernels=fitted.dataset.kernels)
            X = asked.features(fitted.window_s, fitted.samples)
            said = fitted.classifier.predict(X)[arguments.task]
            here = int((said == asked.labels(arguments.task)).sum())
            here += asked.untouched_labels(arguments.task).count(NO_CONTACT)
            right, total = right + here, total + len(new)
            print(
                f"fold {fold}: {here} of {len(new)} right, printed {chosen.accuracy.accuracy:.1%}; "
                f"{chosen.choice}; {' '.join(fitted.notes)}",
                flush=True,
            )
    result = Result(right, total)
    print(f"{right} of {total} right: {result.accuracy:.1%} ({interval(result)})")


if __name__ == "__main__":
    main()
