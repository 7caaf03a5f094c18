"""A frame's whole path and a decision as a share of 10 ms; cold start and memory."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from edge.classifier import Classifier
from edge.model.model import Model
from edge.model.verify import first_series
from edge.recording import load
from export.__main__ import main as export

ROOT = Path(__file__).parents[1]
FRAME_S = 0.010


@pytest.fixture(scope="session")
def built(tmp_path_factory):
    """(model path, data folder): the default simulated set, exported."""
    from train.__main__ import main as train

    folder = tmp_path_factory.mktemp("built")
    data = folder / "data"
    assert train(["simulate", str(ROOT / "train/scenes/cody18.toml"), "--out", str(data)]) == 0
    assert export(["--data", str(data), "--out", str(folder)]) == 0
    return folder / "model.onnx", data


def bench_frame_in_contact(against, note, built):
    path, data = built
    model = Model(path)
    recording = load(sorted(data.glob("*.npz"))[0])
    frames = list(recording)[: round(1.2 / FRAME_S)]

    def watch():
        classifier = Classifier(model, recording.layout)
        for frame in frames:
            classifier.push(frame)

    share = against(watch, {}, calls=1) / len(frames) / FRAME_S
    note("a 10 ms frame", share, "at most 0.01")


@pytest.fixture(scope="session")
def asked(built):
    """(model, first contact's series)."""
    path, data = built
    model = Model(path)
    return model, first_series(load(sorted(data.glob("*.npz"))[0]), model)[1]


def bench_decision_of_all_tasks(against, note, asked):
    model, series = asked
    vector = model.info.vector(series)
    share = against(lambda: model.decide(vector), {}) / FRAME_S
    note("a 10 ms frame", share, "at most 0.01")


SKLEARN = """
    import sys
    import numpy as np
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import StandardScaler
    from sklearn.decomposition import PCA
    from sklearn.neighbors import KNeighborsClassifier
    X = np.load(sys.argv[1])["X"]
    y = np.load(sys.argv[1])["y"]
    model = make_pipeline(StandardScaler(), PCA(7), KNeighborsClassifier(2)).fit(X, y)
    print(model.predict(X[:1]))
"""


def bench_cold_start(against, built, tmp_path):
    """From the start of the process to its first decision."""
    import numpy as np

    from train.dataset import load_trials

    path, data = built
    trials = load_trials([data])
    np.savez(tmp_path / "xy.npz", X=trials.features(), y=trials.labels("object"))
    program = tmp_path / "usual.py"
    program.write_text(textwrap.dedent(SKLEARN))
    recording = sorted(data.glob("*.npz"))[0]
    ours = [sys.executable, "-m", "edge.cli", "replay", "--model", str(path), str(recording)]
    usual = [sys.executable, str(program), str(tmp_path / "xy.npz")]

    def start(command, sign):
        def until_decided():
            # Unbuffered, so that its line is here as soon as it is decided; compiled once and
            # for all, as an installed package is.
            environment = {**os.environ, "PYTHONUNBUFFERED": "1"}
            environment.pop("PYTHONDONTWRITEBYTECODE", None)
            pipe = subprocess.PIPE
            with subprocess.Popen(command, cwd=ROOT, stdout=pipe, env=environment) as process:
                decided = any(sign in line for line in process.stdout)
                process.kill()
            assert decided

        return until_decided

    against(
        start(ours, b'"decision"'),
        {"scikit-learn's pipeline": start(usual, b"'")},
        least={"scikit-learn's pipeline": 6},
        calls=1,
        rounds=7,
    )


def bench_peak_memory(note, built):
    path, data = built
    recording = sorted(data.glob("*.npz"))[0]
    code = (
        "import sys; from edge.cli import main; main(sys.argv[1:]); "
        # Not ru_maxrss, which keeps what the parent had before exec.
        "print(*(x.split()[1] for x in open('/proc/self/status') if x.startswith('VmHWM')), "
        "file=sys.stderr)"
    )
    command = [sys.executable, "-c", code, "replay", "--model", str(path), str(recording)]
    run = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True)
    note("60 MiB", int(run.stderr.split()[-1]) / 1024 / 60, "at most 1")
