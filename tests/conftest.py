"""Recordings small enough to read, a model fitted on them, and the command as a user
runs it."""

import csv
import json
import os
import subprocess
import sys
import time
from contextlib import suppress
from dataclasses import replace
from itertools import product
from multiprocessing import active_children
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from joblib.externals.loky import get_reusable_executor

import train
from edge.app.cli import main as edge_classify
from edge.decide.onnx_file import DIGEST
from edge.record.recording import Recording
from edge.record.saving import save
from edge.touch.layout import SkinLayout
from export.__main__ import main as export_main
from export.graph import with_digest

# Each run draws the same examples, so only a change can turn a test red; `EXPLORE=1`
# draws others. There are no deadlines, because a busy machine must not turn a test red.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("explore", derandomize=False, deadline=None)
settings.load_profile("explore" if os.environ.get("EXPLORE") else "same")

# pytest keeps every core busy itself.
os.environ.setdefault("LOKY_MAX_CPU_COUNT", "1")
FAST_S = 5.0
"""Seconds of processor time that a test without the mark `slow` may take, its fixtures
among them, on a machine that adds a million numbers in `LOOP_S`."""
LOOP_S = 0.05
STARTED = pytest.StashKey[float]()

ROOT = Path(__file__).parents[1]
REAL = ROOT.parent / "shared" / "real"


def processor_s():
    """Seconds of processor time of this process and of those that it has waited for.

    It ends the processes of joblib first: the time of a process counts once it has ended,
    and idle ones end after five minutes, when another test runs.
    """
    if active_children():
        get_reusable_executor().shutdown()
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def slowness():
    """How many times longer than `LOOP_S` this machine now takes. A busy one shares its
    processors' units, so that processor time grows too."""
    began_s = time.process_time()
    total = 0
    for number in range(1_000_000):
        total += number
    return (time.process_time() - began_s) / LOOP_S


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item):
    """Remember when a test's fixtures begin."""
    item.stash[STARTED] = processor_s()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    """Fail a fast test that takes long: it belongs to the slow tier."""
    report = yield
    if call.when == "call" and report.passed and not item.get_closest_marker("slow"):
        spent_s = processor_s() - item.stash[STARTED]
        if spent_s > FAST_S and spent_s > FAST_S * slowness():
            report.outcome = "failed"
            report.longrepr = (
                f"{item.nodeid} took {spent_s:.1f} s of processor time with its "
                f"fixtures; make it shorter or mark it slow (over {FAST_S:g} s)"
            )
    return report


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
    kind="hard",
    seed=0,
    seconds=1.6,
    lead_s=0.2,
    arm=True,
    rate=100.0,
    labels=None,
):
    """A contact that grows: a hard one in force, a soft one in area. It imitates no
    physics."""
    rng = np.random.default_rng([seed, len(kind)])
    n = round((lead_s + seconds) * rate)
    t = np.arange(n) / rate
    rows, cols = FOREARM.shape
    row = rng.integers(4, 10)
    col = rng.integers(0, cols)
    slope = rng.uniform(0.8, 1.2)
    down = np.abs(np.arange(rows) - row)[:, None]
    round_it = np.abs((np.arange(cols) - col + cols // 2) % cols - cols // 2)
    frames = np.zeros((n, rows, cols), dtype=np.uint16)
    for i in np.flatnonzero(t >= lead_s):
        age = (t[i] - lead_s) * slope
        force = 300 + age * (4000 if kind == "hard" else 500)
        reach = 1 if kind == "hard" else 1 + int(3 * age)
        pressed = np.maximum(down, round_it) <= reach
        frames[i] = pressed * force / (1 + down + round_it)
    joints = np.tile([0.2, 0.1, 0.0, 1.2, 0.0], (n, 1))
    joints[:, 0] += 0.3 * t * slope
    softness = "rigid" if kind == "hard" else "soft"
    usual = {"category": f"{softness}-fixed", "object": f"{kind} {seed % 2}"}
    meta = {
        "labels": labels or usual,
        "skin": FOREARM.to_dict(),
        "source": "test",
        "trial": seed,
    }
    return Recording(t, frames, joints=joints if arm else None, meta=meta)


@pytest.fixture(scope="session")
def make_touch():
    """The function that makes a contact."""
    return touch


def save_touches(folder, count, **more):
    """The folder, with so many hard and so many soft touches, in the order of their
    seeds."""
    digits = len(str(count - 1))
    for kind, seed in product(("hard", "soft"), range(count)):
        path = folder / f"{kind}_{seed:0{digits}}.npz"
        save(path, touch(kind=kind, seed=seed, **more))
    return folder


@pytest.fixture(scope="session")
def forearm():
    """A skin of 16 x 24 taxels on a cylinder, 1000 counts per newton."""
    return FOREARM


@pytest.fixture(scope="session")
def recordings(tmp_path_factory):
    """A folder of 16 labelled recordings, 4 objects in 2 categories, with joint
    angles."""
    return save_touches(tmp_path_factory.mktemp("recordings"), 8)


def in_a_row(*touches, rest=50):
    """Touches one after another at 100 Hz, each with so many frames of rest after
    it."""
    frames = [np.pad(one.frames, ((0, rest), (0, 0), (0, 0))) for one in touches]
    joints = [np.pad(one.joints, ((0, rest), (0, 0)), "edge") for one in touches]
    t = np.arange(sum(map(len, frames))) / 100.0
    return replace(
        touches[0],
        t=t,
        frames=np.concatenate(frames),
        joints=np.concatenate(joints),
    )


def full_pipe():
    """The ends of a pipe, to read and to write, that takes no further byte until it is
    read."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    for size in (4096, 1):
        with suppress(BlockingIOError):
            while True:
                os.write(writing, b"x" * size)
    os.set_blocking(writing, True)
    return reading, writing


def lines(text):
    """The JSON objects of a text, one a line."""
    return [json.loads(line) for line in text.splitlines()]


def decided(events: list[dict], key: str) -> list:
    """What each decision among events has under a key."""
    return [event[key] for event in events if event["event"] == "decision"]


def rows_of(path):
    """The rows of a CSV file, by their columns."""
    return list(csv.DictReader(path.read_text().splitlines()))


@pytest.fixture
def edge(capsys):
    """Run `edge-classify`; returns status, stdout's lines as JSON, and stderr."""

    def run(*arguments, text=False):
        status = edge_classify(list(map(str, arguments)))
        out, err = capsys.readouterr()
        return status, out if text else lines(out), err

    return run


def ended(*words, **options):
    """A command that ran in the project's folder, or in `cwd`, with its output as
    text."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    options = {"cwd": ROOT, **pipes, **options}
    return subprocess.run(list(map(str, words)), text=True, **options)


def python(*arguments, **options):
    """The same of Python."""
    return ended(sys.executable, *arguments, **options)


def started(*arguments, **options) -> subprocess.Popen:
    """A process of `edge-classify` that has been started, with its stderr as text."""
    words = [sys.executable, "-m", "edge", *map(str, arguments)]
    options = {"stderr": subprocess.PIPE, "text": True, **options}
    return subprocess.Popen(words, cwd=ROOT, **options)


def sealed(proto):
    """The bytes of an exported model that was changed, with a digest of its own."""
    data, _, _ = proto.SerializeToString().partition(DIGEST)
    return with_digest(data)


PAPER = ("--features", "paper", "--projection", "pca")
"""Options of `make export` that fix the paper's features, for tests that need no
choice."""


def export(out, *options):
    """Run `make export`, with `--data` among the options; the model's folder."""
    assert export_main(["--out", str(out), "--jobs", "1", *map(str, options)]) == 0
    return out


@pytest.fixture(scope="session")
def exported(recordings, tmp_path_factory):
    """A folder with the model.onnx and golden.npz of those recordings."""
    return export(tmp_path_factory.mktemp("exported"), "--data", recordings, *PAPER)


@pytest.fixture(scope="session")
def fitted(recordings):
    """What training makes of those recordings with the paper's features, before its
    export."""
    return train.fit(str(recordings), features=["paper"], projection="pca", jobs=1)


@pytest.fixture(scope="session")
def real():
    """The folder of real recordings; tests that need it are skipped without it."""
    if not REAL.is_dir():
        pytest.skip(
            "../shared/real is absent: the real recordings are not part of the project"
        )
    return REAL
