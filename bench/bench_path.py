"""A frame's whole path and a decision as a share of 10 ms; cold start and memory."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from edge.classifier import Classifier
from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load
from export.__main__ import main as export
from train.__main__ import main as train
from train.dataset import load_trials

ROOT = Path(__file__).parents[1]
FRAME_S = 0.010
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
PEAK_MEMORY = """
import sys
from edge.cli import main
main(sys.argv[1:])
# ru_maxrss would keep the memory that the parent had before exec.
peak = [line.split()[1] for line in open("/proc/self/status") if line.startswith("VmHWM")]
print(*peak, file=sys.stderr)
"""


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """(model path, data folder, one of its recordings): the default simulated set, exported."""
    folder = tmp_path_factory.mktemp("built")
    data = folder / "data"
    assert train(["simulate", str(ROOT / "train/scenes/cody18.toml"), "--out", str(data)]) == 0
    assert export(["--data", str(data), "--out", str(folder)]) == 0
    return folder / "model.onnx", data, sorted(data.glob("*.npz"))[0]


def bench_frame_in_contact(against, note, built):
    model, recording = Model(built[0]), load(built[2])
    frames = list(recording)[: round(1.2 / FRAME_S)]

    def watch():
        classifier = Classifier(model, recording.layout)
        for frame in frames:
            classifier.push(frame)

    share = against(watch, {}, calls=1) / len(frames) / FRAME_S
    note("a 10 ms frame", share, "at most 0.01")


def bench_decision_of_all_tasks(against, note, built):
    model = Model(built[0])
    _, series = first_series(load(built[2]), model)
    vector = model.info.vector(series)
    share = against(lambda: model.decide(vector), {}) / FRAME_S
    note("a 10 ms frame", share, "at most 0.01")


def bench_cold_start(against, built, tmp_path):
    """From the start of the process to its first decision."""
    path, data, recording = built
    trials, arrays = load_trials([data]), tmp_path / "xy.npz"
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
        start(b'"decision"', "-m", "edge.cli", "replay", "--model", path, recording),
        {"scikit-learn's pipeline": start(b"'", "-c", USUAL, arrays)},
        most={"scikit-learn's pipeline": 1 / 6},
        calls=1,
        rounds=7,
    )


def bench_peak_memory(note, built):
    path, _, recording = built
    command = [sys.executable, "-c", PEAK_MEMORY, "replay", "--model", path, recording]
    run = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    note("60 MiB", int(run.stderr.split()[-1]) / 1024 / 60, "at most 1")
