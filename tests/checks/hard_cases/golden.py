"""`python -m tests.checks.hard_cases.golden`: a model and a golden file of each hard set of
vectors.

`edge-classify verify` on another machine, or with another ONNX Runtime, then says
whether its answers are the same. Every golden file holds the same hard frames beside
its vectors.
"""

import argparse
import math
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from edge.record.saving import save
from export.__main__ import main as export
from export.api import save as save_model
from tests.checks.hard_cases.models import features, labels_for
from tests.checks.hard_cases.neighbours import (
    MANY,
    dominated,
    lattice,
    near_duplicates,
    offset_data,
)
from tests.conftest import FOREARM, touch
from train.data.dataset import load_trials
from train.data.parts import part
from train.fitted import Fitted
from train.model.pipeline import Choice, ContactClassifier


def seam(recording):
    """The contact turned so that it lies across the seam."""
    column = int(recording.frames[-1].sum(axis=0).argmax())
    return replace(recording, frames=np.roll(recording.frames, -column, axis=2))


def saturated(recording):
    full = np.where(recording.frames > 0, 65535, 0).astype(np.uint16)
    return replace(recording, frames=full)


def jittered(recording):
    """Uneven times, one instant twice, a gap."""
    rng = np.random.default_rng(1)
    t = np.cumsum(rng.uniform(0.002, 0.018, len(recording.t)))
    t[60] = t[59]
    t[80:] += 0.15
    return replace(recording, t=t)


def split(recording):
    """The taxel with the most force cannot be read."""
    valid = np.ones(FOREARM.shape, dtype=bool)
    valid[np.unravel_index(recording.frames[-1].argmax(), FOREARM.shape)] = False
    return replace(recording, valid=valid)


def wrapped(recording):
    """The first joint's angle jumps by a turn from frame to frame."""
    joints = recording.joints.copy()
    joints[::2, 0] += 2.0 * math.pi
    return replace(recording, joints=joints)


def short(recording):
    """Let go after half the window, and touched from the first frame on."""
    pressed = part(recording, slice(20, None))
    frames = pressed.frames.copy()
    frames[60:] = 0
    return replace(pressed, frames=frames)


def hard_trials(folder):
    """Contacts with everything that frames and times can do to them, stored in a
    folder."""
    changes = (seam, saturated, jittered, split, wrapped, short)
    for seed in range(2 * len(changes)):
        change = changes[seed % len(changes)]
        for kind in ("hard", "soft"):
            trial = change(touch(kind=kind, seed=seed))
            save(folder / f"{change.__name__}-{kind}-{seed}.npz", trial)
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


def main(argv=None):
    """Write OUT/CASE/model.onnx and golden.npz."""
    parser = argparse.ArgumentParser(prog="golden", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("build/hard-cases/golden"))
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as trials:
        dataset = hard_trials(Path(trials))
        for name, (X, choice) in vectors(dataset).items():
            labels = labels_for(X, 80 if name == MANY_LABELS else 5)
            fitted = Fitted(
                dataset=dataset,
                measured=dataset,
                window_s=1.2,
                samples=X.shape[1] // 3,
                X=X,
                chosen={},
                candidates=(),
                classifier=ContactClassifier({"t": choice}).fit(X, {"t": labels}),
            )
            save_model(arguments.out / name / "model.onnx", fitted)
            print(arguments.out / name)
        # Decisions before the full window.
        out = str(arguments.out / "decision_points")
        points = ("--decision-points", "0.6:1.2:0.3", "--jobs", "1")
        return export(["--data", trials, "--out", out, *points])


if __name__ == "__main__":
    sys.exit(main())
