"""The wheel on aarch64 under qemu: numbers as on x86, tests of the edge, instructions executed.

`make board-test` builds the wheel and runs this. Without apt or a network the tests are skipped
with the reason, except in CI.
"""

import csv
import json
import os
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parent
sys.path.insert(0, str(HERE))

import aarch64  # noqa: E402
import debian  # noqa: E402

from edge.demo import FOLDER, MODEL  # noqa: E402
from tests.hard_cases import elsewhere  # noqa: E402
from tests.hard_cases import golden as hard_golden  # noqa: E402

TABLE = aarch64.FOLDER / "instructions.csv"
EMULATED = ("touch", "model", "skin", "test_classifier.py", "test_recording.py")
"""Tests of edge/ that compute; commands, drivers and fakes are the same Python everywhere."""


@pytest.fixture(scope="session")
def python():
    (wheel,) = sorted((CHECKOUT / "dist").glob("edge_classify-*.whl"))
    with debian.skipping():
        return aarch64.build(wheel)


@pytest.fixture(scope="session")
def run(python, tmp_path_factory):
    """Runs the emulated Python on the wheel, away from the checkout; returns what it printed."""
    work = tmp_path_factory.mktemp("work")

    def run(*arguments, **environment):
        done = subprocess.run(
            [python, *map(str, arguments)],
            cwd=work,
            env={**os.environ, "PYTHONPATH": "", **environment},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    return run


def test_labels_neighbours_and_integers_are_those_of_x86_and_floats_within_the_bound(
    python, exported, tmp_path
):
    """In one process, as its start takes long: shipped model, the tests' model, the hard cases."""
    assert hard_golden.main(["--out", str(tmp_path)]) == 0
    tests = CHECKOUT / "tests" / "golden"
    for name, model, outputs in (
        ("demo", MODEL, tests / "demo.npz"),
        ("tests", exported / "model.onnx", exported / "golden.npz"),
    ):
        (tmp_path / name).mkdir()
        shutil.copy(model, tmp_path / name / "model.onnx")
        shutil.copy(outputs, tmp_path / name / "golden.npz")
    machine, shares = elsewhere.ask(tmp_path, [str(python)])
    assert machine["machine"] == "aarch64"
    assert {name for name, _ in shares} == {folder.name for folder in elsewhere.sets(tmp_path)}
    assert {("demo", "series counts"), ("demo", "object_label")} <= set(shares)
    print(f"{len(shares)} quantities, at most {max(shares.values()):.2g} of their bounds")
    assert {key: share for key, share in shares.items() if share > 1.0} == {}


def test_the_demo_prints_the_same_lines(run):
    demo = ("-m", "edge", "demo")
    native = subprocess.run([sys.executable, *demo], capture_output=True, text=True, check=True)
    assert timeless(run(*demo)) == timeless(native.stdout)


def timeless(text):
    """Events without the durations that a clock measured."""
    lines = [json.loads(line) for line in text.splitlines()]
    assert lines
    return [{k: v for k, v in line.items() if k != "latency_ms"} for line in lines]


def test_the_tests_of_the_edge_pass(run, exported):
    printed = run(
        *("-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider", "-p", "emulated"),
        *("-c", CHECKOUT / "pyproject.toml", "--rootdir", CHECKOUT, "-o", "pythonpath="),
        *("--durations=10", *(CHECKOUT / "tests" / "edge" / name for name in EMULATED)),
        EDGE_CLASSIFY_EXPORTED=str(exported),
        PYTHONPATH=f"{HERE}:{CHECKOUT}",  # comes after the wheel
    )
    print(printed)


def test_instructions_per_frame_and_per_decision_are_counted(run, tmp_path):
    """Instruction counts do not depend on the speed of the machine."""
    counts, touch = tmp_path / "counts", FOLDER / "cardboard-box-movable.npz"
    environment = {"QEMU_COUNT": str(counts), "PYTHONHASHSEED": "0"}
    steps = run(HERE / "count_guest.py", MODEL, touch, **environment).splitlines()
    marks = [int(line) for line in counts.read_text().split()][:-1]  # the last marks the end
    table: dict[str, list[int]] = {}
    for step, before, after in zip(steps, marks[::2], marks[1::2], strict=True):
        table.setdefault(step, []).append(after - before)
    nothing = min(table.pop("nothing"))
    rows = [
        (step, len(seen), *(round(f(seen)) - nothing for f in (min, statistics.median, max)))
        for step, seen in table.items()
    ]
    with TABLE.open("w", newline="") as file:
        csv.writer(file).writerows([("step", "n", "lowest", "median", "highest"), *rows])
    print(f"aarch64 instructions ({TABLE.relative_to(CHECKOUT)})\n{TABLE.read_text()}")
    medians = {step: median for step, _, _, median, _ in rows}
    assert 0 < medians["frame without contact"] < medians["frame in contact"]
    assert medians["frame in contact"] < medians["frame that decides"]
    assert medians["model"] < medians["frame that decides"]
