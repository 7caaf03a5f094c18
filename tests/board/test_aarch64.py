"""The wheel on aarch64 under qemu: the same numbers as on x86.

`make board-test` builds the wheel and runs this on Debian's Python, in a folder,
without root. qemu and an arm64 Python come with the machine's own apt, and the aarch64
wheels with pip. Nothing is installed on the machine. The emulated Python shows whether
wheels load and numbers agree; it says nothing about time. Without apt or a network the
tests are skipped with the reason, except in CI.
"""

import json
import shutil
import subprocess
import sys
import zipfile

import pytest

from edge.demo import MODEL
from tests.board.debian import CHECKOUT, once, program, run, skipping, unpacked
from tests.checks.hard_cases import elsewhere
from tests.checks.hard_cases import golden as hard_golden
from tests.edge.features.test_vector import BITS

AARCH64 = CHECKOUT / "build" / "aarch64"
pytestmark = pytest.mark.slow
CPU = "cortex-a72"
"""The Raspberry Pi 4's: nothing may need the instructions that newer boards add."""
SYSTEM = ("python3-minimal", "libpython3-stdlib", "libstdc++6", "libgomp1")
PACKAGES = ("numpy", "onnxruntime", "smbus2")
PLATFORMS = ("manylinux2014", "manylinux_2_17", "manylinux_2_27", "manylinux_2_28")
CPUINFO = CHECKOUT / "tests" / "board" / "cpuinfo"
"""A Raspberry Pi 4's. ONNX Runtime reads it, and crashes on one of another
architecture."""


def emulated_python(wheel):
    """The command of an emulated Python that has the wheel and its dependencies.

    Raises:
        Unavailable: apt or a package registry is missing here.
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
        options = "-m pip install --quiet --disable-pip-version-check"
        options += (
            f" --only-binary=:all: --implementation=cp --python-version={version}"
        )
        platforms = [f"--platform={platform}_aarch64" for platform in PLATFORMS]
        where = ["-c", str(constraints), "--target", str(site)]
        pip = [sys.executable, *options.split(), *platforms, *where]
        run([*pip, *PACKAGES], "pip cannot fetch the aarch64 wheels")

    recipe = f"{version}\n{constraints.read_text()}"
    site = once(AARCH64 / "site", recipe, install)
    shutil.rmtree(AARCH64 / "wheel", ignore_errors=True)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(AARCH64 / "wheel")
    path = f"PYTHONPATH={AARCH64}/wheel:{site}"
    command = [*program(qemu, "qemu-aarch64"), "-cpu", CPU]
    command += ["-L", str(root), "-E", path]
    command += "-E PYTHONNOUSERSITE=1 -E PYTHONHASHSEED=0".split()
    run([*command, str(executable), "-c", ""], "qemu does not run here")
    return [*command, str(executable)]


@pytest.fixture(scope="session")
def python(wheel):
    with skipping():
        return emulated_python(wheel)


def test_every_quantity_from_raw_counts_on_has_the_bits_of_x86(
    python,
    exported,
    tmp_path,
):
    """In one process, as its start takes long: shipped model, the tests' model, the
    hard cases."""
    assert hard_golden.measure(tmp_path) == 0
    shutil.copytree(exported, tmp_path / "tests")
    (tmp_path / "demo").mkdir()
    shutil.copy(MODEL, tmp_path / "demo" / "model.onnx")
    golden = CHECKOUT / "tests" / "golden" / "demo.npz"
    shutil.copy(golden, tmp_path / "demo" / "golden.npz")
    machine, equal = elsewhere.ask(tmp_path, python)
    assert machine["machine"] == "aarch64"
    sets = {folder.name for folder in elsewhere.sets(tmp_path)}
    assert {name for name, _ in equal} == sets
    assert [key for key, is_equal in equal.items() if not is_equal] == []


def test_every_vector_of_the_demos_touches_has_the_bits_of_x86(python):
    emulated = subprocess.check_output([*python, "-P", "-c", BITS])
    assert emulated == subprocess.check_output([sys.executable, "-c", BITS])


def test_the_demo_prints_the_same_lines(python, tmp_path):
    emulated = demo(python, tmp_path)
    native = demo([sys.executable], CHECKOUT)
    assert emulated
    assert emulated == native


def demo(command, folder):
    """The events of the demo, without the durations that a clock measured."""
    words = [*command, "-m", "edge", "demo"]
    text = subprocess.check_output(words, cwd=folder, text=True)
    return [json.loads(line) | {"latency_ms": 0} for line in text.splitlines()]
