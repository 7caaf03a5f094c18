"""`python -m bench.outer`: the accuracy of what `make export` makes, on trials that it never saw.

The recordings are divided into five folds. A model that is exported from the others decides each
fold as the board does, so the accuracy printed by an export can be compared with it.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from edge.cli import dispatch
from edge.commands.replay import Summary, decide
from edge.model.model import Model
from edge.recording import find, load
from export.api import save
from train.evaluate import stratified_folds
from train.fitting import fit

FOLDS = 5


def run(arguments: argparse.Namespace) -> int:
    """Measure and print."""
    paths = np.array(find(arguments.data))
    recordings = {path: load(path) for path in paths}
    labels = np.array([each.labels[arguments.task] for each in recordings.values()])
    folds = stratified_folds(labels, FOLDS)
    summary = Summary([arguments.task])
    for fold in range(FOLDS):
        fitted = fit(paths[folds != fold].tolist(), decision_points_s=())
        with tempfile.TemporaryDirectory() as folder:
            save(Path(folder, "model.onnx"), fitted)
            model = Model(Path(folder, "model.onnx"))
        for path in paths[folds == fold]:
            recording = recordings[path]
            summary.add(recording.labels, decide(model, recording, str(path)))
        promised = fitted.chosen[arguments.task].accuracy.accuracy
        print(f"fold {fold}: {promised:.1%} printed by the export", flush=True)
    print(summary.text())
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    top = argparse.ArgumentParser(prog="bench.outer", description=__doc__)
    top.add_argument("data", nargs="+", metavar="REC", help=".npz or folders")
    top.add_argument("--task", default="object", help="task that is scored (%(default)s)")
    top.set_defaults(run=run)
    return dispatch(top, argv)


if __name__ == "__main__":
    sys.exit(main())
