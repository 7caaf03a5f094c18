"""`python -m tests.checks.hard_cases.golden`: a model and a golden file of each hard set of
vectors.

`edge-classify verify` on another machine, or with another ONNX Runtime, then says
whether its answers are the same. Every golden file holds the same hard frames beside
its vectors.
"""

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.decide.model import Model
from edge.record.saving import save
from export import golden
from export.__main__ import main as export
from tests.checks.bench.program import start
from tests.checks.hard_cases.models import Ours, features, labels_for
from tests.checks.hard_cases.neighbours import (
    MANY,
    dominated,
    lattice,
    near_duplicates,
    offset_data,
)
from tests.conftest import touch
from tests.export.microcontroller.recordings import damaged
from train.data.dataset import load_trials
from train.model.pipeline import Choice


def hard_trials(folder):
    """Damaged touches all around the skin, a third of them saturated, stored in a
    folder."""
    rng = np.random.default_rng(1)
    for seed in range(24):
        kind = ("hard", "soft")[seed % 2]
        trial = damaged(touch(kind=kind, seed=seed), rng)
        frames = np.roll(trial.frames, 2 * seed, axis=2)
        if seed % 3 == 0:
            frames = np.where(frames > 0, 65535, 0).astype(np.uint16)
        save(folder / f"{kind}-{seed}.npz", replace(trial, frames=frames))
    return load_trials([folder])


MANY_LABELS = "many-labels"
"""The set whose labels need more than 64 bits, with neighbours that outvote each other."""


def vectors(dataset):
    """Training vectors of each hard case, which are the queries too, and the model's
    settings."""
    return {
        "frames": (dataset.features(), Choice("IV", 5, 2)),
        "near-duplicates": (near_duplicates(160, 1e-7, 0)[0], Choice("none", 6, 5)),
        "near-duplicates-many": (
            near_duplicates(MANY, 1e-7, 0)[0],
            Choice("none", 6, 5),
        ),
        "many": (features(MANY), Choice("IV", 20, 4)),
        MANY_LABELS: (features(MANY), Choice("none", 6, 9)),
        "offset": (offset_data(1e6, 0.01, 0)[0], Choice("none", 6, 5)),
        "tiny": (features(160) * 1e-24, Choice("none", 6, 5)),
        "huge": (features(MANY) * 1e20, Choice("none", 6, 5)),
        "equal-distances": (lattice(0)[0], Choice("none", 3, 8)),
        "duplicates": (np.repeat(features(40), 4, axis=0), Choice("IV", 20, 4)),
        "dominated": (dominated(12.0, 0)[0], Choice("III", 6, 5)),
    }


def measure(out):
    """Write OUT/CASE/model.onnx and golden.npz."""
    with tempfile.TemporaryDirectory() as trials:
        dataset = hard_trials(Path(trials))
        for name, (X, choice) in vectors(dataset).items():
            ours = Ours(X, labels_for(X, 80 if name == MANY_LABELS else 5), choice)
            path = Path(out) / name / "model.onnx"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(ours.data)
            golden.write(path.with_name("golden.npz"), Model(path), dataset, X)
            print(name)
        # Decisions before the full window.
        words = ("--decision-points", "0.6:1.2:0.3", "--jobs", "1")
        return export(["--data", trials, "--out", f"{out}/decision_points", *words])


if __name__ == "__main__":
    start(measure, __doc__, ("--out", "build/hard-cases/golden", "their folder"))
