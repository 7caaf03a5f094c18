"""Cold start: from the start of the process to its first decision.

`edge-classify bench` times a frame, a decision and memory on any machine.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

from export.__main__ import main as export
from train.__main__ import main as train
from train.dataset import load_trials

ROOT = Path(__file__).parents[1]
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
    data, arrays = tmp_path / "data", tmp_path / "xy.npz"
    assert train(["simulate", str(ROOT / "train/scenes/cody18.toml"), "--out", str(data)]) == 0
    assert export(["--data", str(data), "--out", str(tmp_path), "--quick"]) == 0
    path, recording = tmp_path / "model.onnx", min(data.glob("*.npz"))
    trials = load_trials([data])
    np.savez(arrays, X=trials.features(), y=trials.labels("object"))
    # Unbuffered, so that a line arrives as soon as it is printed; with compiled files, as an
    # installed package has them.
    environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)

    def start(sign, *arguments):
        def until_decided():
            with subprocess.Popen(
                [sys.executable, *arguments], cwd=ROOT, stdout=subprocess.PIPE, env=environment
            ) as process:
                decided = any(sign in line for line in process.stdout)
                process.kill()
            assert decided

        return until_decided

    against(
        start(b'"decision"', "-m", "edge", "replay", "--model", path, recording),
        {"scikit-learn's pipeline": start(b"'", "-c", USUAL, arrays)},
        most={"scikit-learn's pipeline": 1 / 6},
        calls=1,
        rounds=7,
        timer=time.perf_counter,
    )
