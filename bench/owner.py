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
from train.dataset import DataSet, load_trials
from train.feature_sets import expand
from train.mix import ALONE, ONCE, SIMULATED, mix
from train.pipeline import ContactClassifier

COUNTS = (5, 10, 20, 40, 80)
TASKS = ("category", "mobility")
COLUMNS = ("simulated", "own", "both", "half", "chosen", "taught")


def renamed(source: Path, target: Path) -> Path:
    """The trials of a folder, with their kind and number as the object."""
    for path in sorted(source.rglob("*.npz")):
        trial = load(path)
        labels = {**trial.labels, LEAVE_OUT: " ".join(path.stem.split("-")[:2])}
        save(target / path.name, replace(trial, meta={**trial.meta, "labels": labels}))
    return target


def main() -> None:
    """Print a row for each task and number of trials."""
    parser = argparse.ArgumentParser(prog="bench.owner", description=__doc__.split("\n\n")[0])
    parser.add_argument("--simulated", type=Path, required=True)
    parser.add_argument("--own", type=Path, required=True)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    names = expand([name for sets in DRAWN_WITH_JOINTS for name in sets])
    with tempfile.TemporaryDirectory() as folder:
        data = [str(renamed(options.own, Path(folder))), str(options.simulated)]
        trials = load_trials(data, features=names, horizon_s=WINDOW_S, partial=True)
    own, objects = trials.own, trials.groups(LEAVE_OUT)
    assert own is not None and objects is not None
    y = {task: trials.labels(task) for task in TASKS}
    X = trials.features(WINDOW_S, SAMPLES)

    def settings(of: DataSet, labels):
        tried = candidates(labels, joints=of.joints > 0, drawn=True, quick=True)
        choosing = Choosing(of, labels, tried, SAMPLES, quick=True, jobs=cpu_count())
        return choosing.choose(WINDOW_S)[0]

    chosen = settings(trials.part(~own), {task: labels[~own] for task, labels in y.items()})
    print(f"{'':<16}" + "".join(f"{name:>10}" for name in COLUMNS))
    for count in COUNTS:
        right: dict[str, list[list[float]]] = {task: [] for task in TASKS}
        for repeat in range(options.repeats):
            rng = np.random.default_rng([repeat])
            order = rng.permutation(np.unique(objects[own]))
            known = own & np.isin(objects, order[: len(order) // 2])
            known[np.flatnonzero(known)[rng.permutation(known.sum())[count:]]] = False
            used, asked = known | ~own, own & np.isin(objects, order[len(order) // 2 :])
            labels = {task: each[used] for task, each in y.items()}
            mixed, *_ = mix(
                trials.part(used), labels, own[used], lambda *_: dict(chosen), X[used], SAMPLES,
                LEAVE_OUT, quick=True, jobs=cpu_count(),
            )  # fmt: skip
            half = round((~own).sum() / count)
            for task in TASKS:
                best = mixed[task].choice
                shares = []
                for weights in (SIMULATED, ALONE, ONCE, (1, half), best.weights):
                    k = min(best.k, count // 2)
                    classifier = ContactClassifier(
                        {task: replace(best, weights=weights, k=k)},
                        trials.names,
                        trials.widths(SAMPLES),
                    ).fit(X[used], labels, own[used])
                    told = classifier.predict(X[asked])[task]
                    shares.append(float((told == y[task][asked]).mean()))
                simulated = ContactClassifier(
                    {task: replace(best, weights=ONCE)}, trials.names, trials.widths(SAMPLES)
                ).fit(X[~own], {task: each[~own] for task, each in y.items()})
                (space,) = simulated.spaces_.values()
                classes = simulated.classes_[task].searchsorted(y[task][known])
                simulated.labels_[task] = np.append(simulated.labels_[task], classes)
                rows = simulated.rows_[space], simulated.project(space, X[known])
                simulated.rows_[space] = np.vstack(rows)
                told = simulated.predict(X[asked])[task]
                right[task].append([*shares, float((told == y[task][asked]).mean())])
        for task, rows in right.items():
            means = 100.0 * np.mean(rows, axis=0)
            print(f"{task:<11}{count:>4} " + "".join(f"{mean:>10.1f}" for mean in means))


if __name__ == "__main__":
    main()
