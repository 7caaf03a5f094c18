"""Recordings small enough to read, and a model fitted on them."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from edge.recording import Recording, save
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout

# Each run draws the same examples, so only a change can turn a test red; `EXPLORE=1` draws others.
# There are no deadlines, because a busy machine must not turn a test red.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile("explore" if os.environ.get("EXPLORE") else "same")

ROOT = Path(__file__).parents[1]
REAL = ROOT.parent / "shared" / "real"

FOREARM = SkinLayout(
    rows=16,
    cols=24,
    wraps=True,
    pitch_m=(0.0108, 0.01205),
    radius_m=0.04604,
    row0_z_m=0.18432,
    counts_per_newton=1000.0,
    threshold_counts=100,
    onset_counts=150,
)


def touch(
    *,
    kind: str = "hard",
    seed: int = 0,
    seconds: float = 1.6,
    lead_s: float = 0.2,
    layout: SkinLayout = FOREARM,
    arm: bool = True,
    rate: float = 100.0,
    labels: dict[str, str] | None = None,
) -> Recording:
    """A contact that grows: a hard one in force, a soft one in area. It imitates no physics."""
    rng = np.random.default_rng([seed, len(kind)])
    n = round((lead_s + seconds) * rate)
    t = np.arange(n) / rate
    frames = np.zeros((n, layout.rows, layout.cols), dtype=np.uint16)
    row, col = rng.integers(4, 10), rng.integers(0, layout.cols)
    slope = rng.uniform(0.8, 1.2)
    for i in np.flatnonzero(t >= lead_s):
        age = (t[i] - lead_s) * slope
        force = 300 + age * (4000 if kind == "hard" else 500)
        reach = 1 if kind == "hard" else 1 + int(3 * age)
        for r in range(max(row - reach, 0), min(row + reach + 1, layout.rows)):
            for c in range(col - reach, col + reach + 1):
                frames[i, r, c % layout.cols] = force / (1 + abs(r - row) + abs(c - col))
    joints = None
    if arm:
        chain = Chain.cody()
        joints = np.tile([0.2, 0.1, 0.0, 1.2, 0.0], (n, 1))
        joints[:, 0] += 0.3 * t * slope
        assert joints.shape[1] == chain.dof
    own = {"category": f"{'rigid' if kind == 'hard' else 'soft'}-fixed"}
    own["object"] = f"{kind} {seed % 2}"
    meta = {"labels": labels or own, "skin": layout.to_dict(), "source": "test", "trial": seed}
    return Recording(t=t, frames=frames, joints=joints, meta=meta)


@pytest.fixture(scope="session")
def make_touch():
    """The function that makes a contact."""
    return touch


def save_touches(folder: Path, count: int, **more) -> Path:
    """The folder, with so many hard and so many soft touches."""
    for kind in ("hard", "soft"):
        for seed in range(count):
            save(folder / f"{kind}_{seed:02d}.npz", touch(kind=kind, seed=seed, **more))
    return folder


@pytest.fixture(scope="session")
def forearm() -> SkinLayout:
    """A skin of 16 x 24 taxels on a cylinder, 1000 counts per newton."""
    return FOREARM


@pytest.fixture(scope="session")
def recordings(tmp_path_factory) -> Path:
    """A folder of 16 labelled recordings, 4 objects in 2 categories, with joint angles."""
    folder = tmp_path_factory.mktemp("recordings")
    for kind in ("hard", "soft"):
        for seed in range(8):
            save(folder / f"{kind}_{seed}.npz", touch(kind=kind, seed=seed))
    return folder


def python(*arguments, **options) -> subprocess.CompletedProcess:
    """A process of its own that ran Python in the project's folder, with its output as text."""
    options = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **options}
    return subprocess.run([sys.executable, *arguments], cwd=ROOT, text=True, **options)


PAPER = ("--features", "paper", "--projection", "pca", "--samples", "40", "--jobs", "1")
"""Options of `make export` that fix the paper's features, for tests that need no choice."""


@pytest.fixture(scope="session")
def exported(recordings, tmp_path_factory) -> Path:
    """A folder with the model.onnx and golden.npz of those recordings."""
    from export.__main__ import main

    out = tmp_path_factory.mktemp("exported")
    assert main(["--data", str(recordings), "--out", str(out), *PAPER]) == 0
    return out


@pytest.fixture(scope="session")
def real() -> Path:
    """The folder of real recordings; tests that need it are skipped without it."""
    if not REAL.is_dir():
        pytest.skip("../shared/real is absent: the real recordings are not part of the project")
    return REAL
