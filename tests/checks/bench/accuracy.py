"""`make accuracy`: the accuracies that an export prints, and those of peers.

Each set is fitted as `make export` would fit it. The accuracies are nested: of the
entire choice, on trials that took no part in it, with the interval of the exported model
on other trials, or on other objects or kinds where entire groups are left out.

The second table is of simulated skins like those of other people. Each fold is decided
by the board's classifier, with a model of the other folds, and by peers that see the
raw channels of entire recordings.
"""

import tempfile
from itertools import compress, product
from pathlib import Path

import numpy as np
from aeon.classification.convolution_based import MiniRocketClassifier
from joblib import cpu_count
from sklearn.ensemble import ExtraTreesClassifier
from sklearn.model_selection import PredefinedSplit, cross_val_predict

import edge
import train
from tests.checks.bench import tables
from tests.checks.bench.program import start
from tests.checks.bench.shifts import decisions, exported
from tests.checks.other_skins import SKINS, touch
from train.__main__ import main as train_command
from train.data.folds import stratified_folds
from train.progress import bar
from train.report.work import Workers

FOLDS = 5


def recorded(folder, grasps):
    """Sets of recordings, which are simulated or imported into a folder: name, folder,
    options of the fit."""
    for scene in ("cody18", "household"):
        out = folder / scene
        path = tables.SCENES / f"{scene}.toml"
        train_command(["simulate", str(path), "--out", str(out)])
        yield f"`{scene}`, simulated", out, {}
    if grasps:
        out = folder / "sdh2"
        train_command(["import", "sdh2", grasps, "--out", str(out)])
        by_touch = {"features": ["moments"], "projection": "lda"}
        yield "SDH-2 grasps, by touch alone", out, by_touch
        yield "SDH-2 grasps, with joint angles, which leak", out, {}


def accuracies(name, folder, options):
    """A row for each task of a set of recordings."""
    fitted = train.fit(folder, **options)
    dataset = fitted.dataset
    for task, chosen in fitted.chosen.items():
        low, high = chosen.accuracy.interval
        yield {
            "recordings": name,
            "trials": len(dataset.trials),
            "task": task,
            "labels": len(set(dataset.labels(task))),
            "left out": chosen.held_out,
            "accuracy": f"{chosen.accuracy.accuracy:.0%}",
            "95 % interval": f"{low:.0%} to {high:.0%}",
        }


def beside_peers(name):
    """A row: accuracies on the folds of a skin's set."""
    skin = SKINS[name]
    numbers = product(range(skin.objects), range(skin.trials))
    recordings = [touch(skin, *number) for number in numbers]
    labels = np.array([recording.labels["object"] for recording in recordings])
    folds = stratified_folds(labels, FOLDS)
    X = np.stack([channels(recording) for recording in recordings])

    def right(estimator, X):
        answers = cross_val_predict(estimator, X, labels, cv=PredefinedSplit(folds))
        return f"{(answers == labels).mean():.1%}"

    return {
        "recordings": name,
        "trials": len(labels),
        "labels": skin.objects,
        "export": f"{of_folds(recordings, folds):.1%}",
        "MiniRocket, ridge": right(MiniRocketClassifier(random_state=0), X),
        "extra trees": right(
            ExtraTreesClassifier(300, random_state=0), X.reshape(len(X), -1)
        ),
    }


def of_folds(recordings, folds):
    """The share of touches that exports of the other folds decide rightly."""
    right = 0
    for fold in np.unique(folds):
        with tempfile.TemporaryDirectory() as folder:
            for i in np.flatnonzero(folds != fold):
                edge.save(f"{folder}/{i:03}.npz", recordings[i])
            model = exported(folder, jobs=1)
        touches = compress(recordings, folds == fold)
        answers = decisions(model, touches).drop_duplicates("touch")
        right += (answers["label"] == answers["truth"]).sum()
    return right / len(folds)


def channels(recording):
    """(channels, frames) all that a recording holds."""
    parts = (recording.frames, recording.shear, recording.joints)
    flat = [part.reshape(len(part), -1) for part in parts if part is not None]
    return np.hstack(flat).astype(np.float32).T


def measure(grasps):
    """Fit the sets, print and write the tables."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        sets = list(recorded(Path(name), grasps))
        for label, recordings, options in bar(sets, desc="sets"):
            rows += accuracies(label, recordings, options)
    cases = [(name,) for name in SKINS]
    beside = Workers(cpu_count()).map("skins", beside_peers, cases)
    tables.write("accuracy", [rows, beside])


if __name__ == "__main__":
    start(measure, __doc__, ("--grasps", "", "folder of the published SDH-2 grasps"))
