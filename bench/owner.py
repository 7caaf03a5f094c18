"""An owner's first trials beside simulated ones: what each gives on objects never met.

Takes a simulated set, and trials of another engine in the place of the owner's: those that `make
transfer` leaves in `build/transfer/seedN`, where the numbers in a file's name tell the object. Half
of the objects are always left out; of the other half, N trials are the owner's. Prints the share of
the left-out trials that are decided rightly by the simulated trials alone, the owner's alone, both,
both with the owner's at half of the weight, with the weight that `make export SCENE=... DATA=...`
chooses on the owner's trials, and by a model of the simulated ones that was taught the owner's.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from joblib import cpu_count

from edge.recording import load, save
from edge.touch.features import SAMPLES, WINDOW_S
from train.candidates import DRAWN_WITH_JOINTS, candidates
from train.choose import LEAVE_OUT, Choosing
from train.dataset import load_trials
from train.feature_sets import expand
from train.mix import ALONE, ONCE, SIMULATED, mix
from train.pipeline import ContactClassifier

COUNTS = (5, 10, 20, 40, 80)
TASKS = ("category", "mobility")
COLUMNS = ("simulated", "own", "both", "half", "chosen", "taught")


def load_both(owners: Path, simulated: Path):
    """The trials of both folders; an owner's have their kind and number as the object."""
    names = expand([name for sets in DRAWN_WITH_JOINTS for name in sets])
    with tempfile.TemporaryDirectory() as folder:
        for path in sorted(owners.rglob("*.npz")):
            trial = load(path)
            labels = {**trial.labels, LEAVE_OUT: " ".join(path.stem.split("-")[:2])}
            save(Path(folder, path.name), replace(trial, meta={**trial.meta, "labels": labels}))
        data = [folder, str(simulated)]
        return load_trials(data, features=names, horizon_s=WINDOW_S, partial=True)


def teach(classifier: ContactClassifier, task: str, X, labels) -> None:
    """Add trials to the neighbours of a fitted classifier of a single task."""
    (space,) = classifier.spaces_.values()
    indices = classifier.classes_[task].searchsorted(labels)
    classifier.labels_[task] = np.append(classifier.labels_[task], indices)
    rows = classifier.rows_[space], classifier.project(space, X)
    classifier.rows_[space] = np.vstack(rows)


def main() -> None:
    """Print a row for each task and number of trials."""
    parser = argparse.ArgumentParser(prog="bench.owner", description=__doc__.split("\n\n")[0])
    parser.add_argument("--simulated", type=Path, required=True)
    parser.add_argument("--own", type=Path, required=True)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    trials = load_both(options.own, options.simulated)
    own, objects = trials.own, trials.groups(LEAVE_OUT)
    y = {task: trials.labels(task) for task in TASKS}
    X, form = trials.features(WINDOW_S, SAMPLES), (trials.names, trials.widths(SAMPLES))
    simulated_y = {task: labels[~own] for task, labels in y.items()}
    simulated = trials.part(~own)
    tried = candidates(simulated_y, joints=simulated.joints > 0, drawn=True, quick=True)
    choosing = Choosing(simulated, simulated_y, tried, SAMPLES, quick=True, jobs=cpu_count())
    settings = choosing.choose(WINDOW_S)[0]

    def shares(count: int, repeat: int):
        """{task: [column] share of the left-out trials that are decided rightly}."""
        rng = np.random.default_rng([repeat])
        order = rng.permutation(np.unique(objects[own]))
        known = own & np.isin(objects, order[: len(order) // 2])
        known[np.flatnonzero(known)[rng.permutation(known.sum())[count:]]] = False
        used, asked = known | ~own, own & np.isin(objects, order[len(order) // 2 :])
        labels = {task: each[used] for task, each in y.items()}
        mixed, *_ = mix(
            trials.part(used), labels, own[used], lambda *_: dict(settings), X[used], SAMPLES,
            LEAVE_OUT, quick=True, jobs=cpu_count(),
        )  # fmt: skip
        half = (1, round((~own).sum() / count))
        right = {}
        for task in TASKS:
            best = mixed[task].choice
            fits = [
                ContactClassifier(
                    {task: replace(best, weights=weights, k=min(best.k, count // 2))}, *form
                ).fit(X[used], labels, own[used])
                for weights in (SIMULATED, ALONE, ONCE, half, best.weights)
            ]
            taught = ContactClassifier({task: replace(best, weights=ONCE)}, *form)
            teach(taught.fit(X[~own], simulated_y), task, X[known], y[task][known])
            answers = [each.predict(X[asked])[task] for each in (*fits, taught)]
            right[task] = [float((answer == y[task][asked]).mean()) for answer in answers]
        return right

    print(f"{'':<16}" + "".join(f"{name:>10}" for name in COLUMNS))
    for count in COUNTS:
        draws = [shares(count, repeat) for repeat in range(options.repeats)]
        for task in TASKS:
            means = 100.0 * np.mean([draw[task] for draw in draws], axis=0)
            print(f"{task:<11}{count:>4} " + "".join(f"{mean:>10.1f}" for mean in means))


if __name__ == "__main__":
    main()
