"""The wheel on aarch64 under qemu: numbers as on x86, tests of the edge, instructions executed.

`make board-test` builds the wheel and runs this. Without apt or a network the tests are skipped
with the reason, except in CI.
"""

import csv
import json
import os
import statistics
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parent
sys.path.insert(0, str(HERE))

import aarch64  # noqa: E402

from tests.hard_cases import elsewhere  # noqa: E402
from tests.hard_cases import golden as hard_golden  # noqa: E402

GOLDEN = CHECKOUT / "tests" / "golden" / "demo.npz"
MODEL = CHECKOUT / "edge" / "demo" / "model.onnx"
TOUCH = CHECKOUT / "edge" / "demo" / "cardboard-box-movable.npz"
HARD = CHECKOUT / "build" / "hard-cases" / "golden"
TABLE = aarch64.FOLDER / "instructions.csv"

EMULATED = ("touch", "model", "skin", "test_classifier.py", "test_recording.py")
"""Tests of edge/ that compute; commands, drivers and fakes are the same Python everywhere."""
NOT_EMULATED = (
    "tests/edge/test_recording.py::test_any_metadata_is_read_or_refused_with_a_sentence",
    "tests/edge/skin/test_loop.py::test_a_long_run_neither_grows_nor_drifts",
)
"""Tests among them that take minutes under emulation."""


@pytest.fixture(scope="session")
def python() -> Path:
    (wheel,) = sorted((CHECKOUT / "dist").glob("edge_classify-*.whl"))
    try:
        return aarch64.build(wheel)
    except aarch64.Unavailable as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(f"no aarch64 here: {error}")


@pytest.fixture(scope="session")
def run(python, tmp_path_factory):
    """Runs a Python (the root's by default) on the wheel alone, away from the checkout."""
    work = tmp_path_factory.mktemp("work")

    def run(*arguments, native=False, **environment):
        path = {"PYTHONPATH": str(aarch64.FOLDER / "wheel") if native else ""}
        return subprocess.run(
            [sys.executable if native else python, *map(str, arguments)],
            cwd=work,
            env={**os.environ, **path, **environment},
            capture_output=True,
            text=True,
            check=False,
        )

    return run


@pytest.fixture(scope="session")
def golden(exported):
    """Models made on this machine, with what they answered here."""
    return {"demo": (MODEL, GOLDEN), "tests": (exported / "model.onnx", exported / "golden.npz")}


@pytest.mark.parametrize("which", ["demo", "tests"])
def test_labels_neighbours_and_integers_are_those_of_x86_and_floats_within_the_bound(
    run, golden, which
):
    model, outputs = golden[which]
    done = run("-m", "edge.cli", "verify", "--model", model, "--golden", outputs)
    assert done.returncode == 0, done.stderr
    checks = [json.loads(line) for line in done.stdout.splitlines()]
    assert {check["name"] for check in checks} >= {"series counts", "object_label"}
    for check in checks:
        print(f"{check['name']:>24} {check['rows']:6} rows, {check['share_of_bound']:.2g} of bound")


def test_the_hard_cases_have_the_same_answers(python):
    assert hard_golden.main(["--out", str(HARD)]) == 0
    machine, shares = elsewhere.ask(HARD, [str(python)])
    assert machine["machine"] == "aarch64"
    assert {of for of, _ in shares} == {folder.name for folder in elsewhere.sets(HARD)}
    print(f"{len(shares)} quantities of hard sets, at most {max(shares.values()):.2g} of bound")
    beyond = {key: share for key, share in shares.items() if share > 1.0}
    assert not beyond


def test_the_emulated_machine_is_not_this_one(run):
    """Otherwise the comparisons would prove nothing."""
    code = "import numpy, platform; print(platform.machine(), numpy.__file__)"
    emulated, native = (run("-c", code, native=n).stdout.split() for n in (False, True))
    assert emulated == ["aarch64", str(aarch64.FOLDER / "site" / "numpy" / "__init__.py")]
    assert native[0] != "aarch64"


def test_the_demo_prints_the_same_lines(run):
    emulated, native = (run("-m", "edge.cli", "demo", native=n) for n in (False, True))
    assert emulated.returncode == 0, emulated.stderr
    assert timeless(emulated.stdout) == timeless(native.stdout)


def timeless(text):
    """Events without what a clock measured."""
    lines = [json.loads(line) for line in text.splitlines()]
    assert lines
    return [{k: v for k, v in line.items() if k != "latency_ms"} for line in lines]


def test_the_tests_of_the_edge_pass(run, exported):
    done = run(
        *("-m", "pytest", "-q", "-n", "2", "-p", "no:cacheprovider", "-p", "emulated"),
        *("-c", CHECKOUT / "pyproject.toml", "--rootdir", CHECKOUT, "-o", "pythonpath="),
        *(f"--deselect={path}" for path in NOT_EMULATED),
        *("--durations=10", *(CHECKOUT / "tests" / "edge" / name for name in EMULATED)),
        EDGE_CLASSIFY_EXPORTED=str(exported),
        PYTHONPATH=f"{HERE}:{CHECKOUT}",  # comes after the wheel
    )
    print(done.stdout)
    assert done.returncode == 0, done.stderr


def test_instructions_per_frame_and_per_decision_are_counted(run, tmp_path):
    """Instruction counts do not depend on the speed of the machine."""
    counts = tmp_path / "counts"
    script = HERE / "count_guest.py"
    done = run(script, MODEL, TOUCH, QEMU_COUNT=str(counts), PYTHONHASHSEED="0")
    assert done.returncode == 0, done.stderr
    marks = [int(line) for line in counts.read_text().split()][:-1]  # the last marks the end
    steps = done.stdout.splitlines()
    assert len(marks) == 2 * len(steps)
    table: dict[str, list[int]] = {}
    for step, before, after in zip(steps, marks[::2], marks[1::2], strict=True):
        table.setdefault(step, []).append(after - before)
    nothing = min(table.pop("nothing"))
    rows = [
        (step, len(seen), *(round(f(seen)) - nothing for f in (min, statistics.median, max)))
        for step, seen in table.items()
    ]
    with TABLE.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["step", "n", "lowest", "median", "highest"])
        writer.writerows(rows)
    print(f"aarch64 instructions ({TABLE.relative_to(CHECKOUT)})")
    for step, n, low, median, high in rows:
        print(f"{step:>24} {n:5} times: {low:9,} to {high:9,}, median {median:9,}")
    medians = {step: median for step, _, _, median, _ in rows}
    assert 0 < medians["frame without contact"] < medians["frame in contact"]
    assert medians["frame in contact"] < medians["frame that decides"]
    assert medians["model"] < medians["frame that decides"]
