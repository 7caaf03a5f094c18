"""Cold start: from the start of the process to its first decision.

`edge-classify bench` times a frame, a decision and memory on any machine.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from edge.demo import FOLDER, MODEL

ROOT = Path(__file__).parents[2]
USUAL = """
import sys
import numpy as np
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.decomposition import PCA
from sklearn.neighbors import KNeighborsClassifier
with np.load(sys.argv[1]) as data:
    X, y = data["X"], data["y"]
model = make_pipeline(StandardScaler(), PCA(7), KNeighborsClassifier(2)).fit(X, y)
print(model.predict(X[:1]))
"""


def bench_cold_start(against, tmp_path):
    """The rival fits as many vectors of the paper's features as the paper has
    trials."""
    arrays = tmp_path / "xy.npz"
    np.savez(
        arrays,
        X=np.random.default_rng(0).normal(size=(140, 120)),
        y=np.arange(140) % 18,
    )
    # Unbuffered, so that a line arrives as soon as it is printed; with compiled files,
    # as an installed package has them.
    environment = os.environ | {"PYTHONUNBUFFERED": "1", "PYTHONDONTWRITEBYTECODE": ""}

    def start(sign, *arguments):
        def until_decided():
            with subprocess.Popen(
                [sys.executable, *arguments],
                cwd=ROOT,
                stdout=subprocess.PIPE,
                env=environment,
            ) as process:
                decided = any(sign in line for line in process.stdout)
                process.kill()
            assert decided

        return until_decided

    replay = ["-m", "edge", "replay", "--model", MODEL, FOLDER / "pillow-movable.npz"]
    against(
        start(b'"decision"', *replay),
        {"scikit-learn's pipeline": (start(b"[", "-c", USUAL, arrays), 1 / 6)},
        calls=1,
        rounds=7,
        timer=time.perf_counter,
    )
