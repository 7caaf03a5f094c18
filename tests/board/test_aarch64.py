"""The wheel on aarch64 under qemu: the same numbers as on x86, and the instructions
executed.

`make board-test` builds the wheel and runs this on Debian's Python, in a folder,
without root. qemu and an arm64 Python come with the machine's own apt, and the aarch64
wheels with pip. Nothing is installed on the machine. The emulated Python shows whether
wheels load and numbers agree; it says nothing about time. Without apt or a network the
tests are skipped with the reason, except in CI.
"""

import csv
import json
import shutil
import statistics
import subprocess
import sys
import zipfile

import pytest

from edge.demo import FOLDER, MODEL
from tests.board.debian import CHECKOUT, once, program, run, skipping, unpacked
from tests.hard_cases import elsewhere
from tests.hard_cases import golden as hard_golden

AARCH64 = CHECKOUT / "build" / "aarch64"
CPU = "cortex-a72"
"""The Raspberry Pi 4's: nothing may need the instructions that newer boards add."""
SYSTEM = ("python3-minimal", "libpython3-stdlib", "libstdc++6", "libgomp1")
PACKAGES = ("numpy", "onnxruntime", "smbus2")
PLATFORMS = ("manylinux2014", "manylinux_2_17", "manylinux_2_27", "manylinux_2_28")
CPUINFO = CHECKOUT / "tests" / "board" / "cpuinfo"
"""A Raspberry Pi 4's. ONNX Runtime reads it, and crashes on one of another
architecture."""
TABLE = AARCH64 / "instructions.csv"


def emulated_python(wheel, counts):
    """The command of an emulated Python that has the wheel and its dependencies.

    Args:
        wheel: of edge-classify.
        counts: a file for the numbers of executed instructions (see count.c).

    Raises:
        Unavailable: apt, a compiler or a package registry is missing here.
    """
    native = run(["dpkg", "--print-architecture"])
    qemu = unpacked(AARCH64 / "qemu", native, ["qemu-user"])
    root = unpacked(AARCH64 / "root", "arm64", SYSTEM)
    (root / "proc").mkdir(exist_ok=True)
    shutil.copy(CPUINFO, root / "proc")
    executable = next((root / "usr" / "bin").glob("python3.[0-9]*"))
    version = executable.name.removeprefix("python")
    constraints = CHECKOUT / "constraints.txt"

    def install(site):
        pip = [
            sys.executable,
            "-m",
            "pip",
            "install",
            "--quiet",
            "--disable-pip-version-check",
        ]
        kind = [
            "--only-binary=:all:",
            "--implementation=cp",
            "--python-version",
            version,
        ]
        kind += [f"--platform={platform}_aarch64" for platform in PLATFORMS]
        command = [
            *pip,
            *kind,
            "-c",
            str(constraints),
            "--target",
            str(site),
            *PACKAGES,
        ]
        run(command, "pip cannot fetch the aarch64 wheels")

    site = once(
        AARCH64 / "site", "\n".join([version, constraints.read_text()]), install
    )
    shutil.rmtree(AARCH64 / "wheel", ignore_errors=True)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(AARCH64 / "wheel")
    plugin = AARCH64 / "count.so"
    source = CHECKOUT / "tests" / "board" / "count.c"
    run(["cc", "-O2", "-Wall", "-shared", "-fPIC", "-o", str(plugin), str(source)])
    variables = (
        f"PYTHONPATH={AARCH64}/wheel:{site}",
        "PYTHONNOUSERSITE=1",
        "PYTHONHASHSEED=0",
    )
    command = [*program(qemu, "qemu-aarch64"), "-plugin", f"{plugin},out={counts}"]
    command += [
        "-cpu",
        CPU,
        "-L",
        str(root),
        *(word for v in variables for word in ("-E", v)),
    ]
    run([*command, str(executable), "-c", ""], "qemu does not run here")
    return [*command, str(executable)]


@pytest.fixture(scope="session")
def counts(tmp_path_factory):
    return tmp_path_factory.mktemp("counts") / "counts"


@pytest.fixture(scope="session")
def python(wheel, counts):
    with skipping():
        return emulated_python(wheel, counts)


def test_labels_neighbours_and_integers_are_those_of_x86_and_floats_within_the_bound(
    python, exported, tmp_path
):
    """In one process, as its start takes long: shipped model, the tests' model, the
    hard cases."""
    assert hard_golden.main(["--out", str(tmp_path)]) == 0
    golden = CHECKOUT / "tests" / "golden" / "demo.npz"
    shutil.copytree(exported, tmp_path / "tests")
    (tmp_path / "demo").mkdir()
    shutil.copy(MODEL, tmp_path / "demo" / "model.onnx")
    shutil.copy(golden, tmp_path / "demo" / "golden.npz")
    machine, shares = elsewhere.ask(tmp_path, python)
    assert machine["machine"] == "aarch64"
    assert {name for name, _ in shares} == {
        folder.name for folder in elsewhere.sets(tmp_path)
    }
    assert {("demo", "series counts"), ("demo", "object_label")} <= set(shares)
    print(
        f"{len(shares)} quantities, at most {max(shares.values()):.2g} of their bounds"
    )
    assert {key: share for key, share in shares.items() if share > 1.0} == {}


def test_the_demo_prints_the_same_lines(python, tmp_path):
    emulated, native = (
        subprocess.check_output([*command, "-m", "edge", "demo"], cwd=folder, text=True)
        for command, folder in ((python, tmp_path), ([sys.executable], CHECKOUT))
    )
    assert timeless(emulated) == timeless(native)


def timeless(text):
    """Events without the durations that a clock measured."""
    lines = [json.loads(line) for line in text.splitlines()]
    assert lines
    return [{k: v for k, v in line.items() if k != "latency_ms"} for line in lines]


def test_the_instructions_of_each_kind_of_frame_are_counted(python, counts, tmp_path):
    """Instruction counts do not depend on the speed of the machine."""
    program = [
        CHECKOUT / "tests" / "board" / "count_guest.py",
        MODEL,
        FOLDER / "cardboard-box-movable.npz",
    ]
    printed = subprocess.check_output([*python, *program], cwd=tmp_path, text=True)
    marks = [int(line) for line in counts.read_text().split()][
        :-1
    ]  # the last marks the end
    instructions = {}
    for kind, before, after in zip(
        printed.splitlines(), marks[::2], marks[1::2], strict=True
    ):
        instructions.setdefault(kind, []).append(after - before)
    medians = {kind: statistics.median(each) for kind, each in instructions.items()}
    with TABLE.open("w", newline="") as file:
        rows = [
            (k, len(v), min(v), medians[k], max(v)) for k, v in instructions.items()
        ]
        csv.writer(file).writerows(
            [("frame", "n", "lowest", "median", "highest"), *rows]
        )
    print(f"aarch64 instructions ({TABLE.relative_to(CHECKOUT)})\n{TABLE.read_text()}")
    assert 0 < medians["frame without contact"] < medians["frame in contact"]
    assert medians["frame in contact"] < medians["frame that decides"]
