"""The wheel in an empty environment outside the checkout, as an owner installs it.

`make wheel-test` builds it and runs this.
"""

import json
import os
import subprocess
import sys
import venv
import zipfile

import pytest

from tests.board.debian import CHECKOUT
from tests.conftest import ended

pytestmark = pytest.mark.slow
LARGEST = 320_000


@pytest.fixture(scope="session")
def contents(wheel):
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def environment_of(folder, *packages):
    """A function that runs `edge-classify ...` from a fresh environment in a folder."""
    programs = folder / "env" / "bin"
    venv.create(programs.parent, symlinks=True)
    pip = [sys.executable, "-m", "pip", "--python", programs / "python", "install"]
    pins = ["--quiet", "-c", CHECKOUT / "constraints.txt"]
    subprocess.run([*pip, *pins, *packages], check=True)
    environment = {k: v for k, v in os.environ.items() if not k.startswith("PYTHON")}

    def run(*arguments, program="edge-classify"):
        return ended(programs / program, *arguments, cwd=folder, env=environment)

    return run


@pytest.fixture(scope="session")
def command(wheel, tmp_path_factory):
    """Runs `edge-classify ...` with all that the wheel asks for."""
    return environment_of(tmp_path_factory.mktemp("elsewhere"), wheel)


@pytest.fixture(scope="session")
def bare_command(wheel, tmp_path_factory):
    """Runs `edge-classify ...` with numpy and smbus2 alone."""
    folder = tmp_path_factory.mktemp("bare")
    return environment_of(folder, "--no-deps", wheel, "numpy", "smbus2")


def test_it_is_small(wheel):
    assert wheel.stat().st_size <= LARGEST


def test_it_holds_edge_alone_and_all_of_it(contents):
    inside = {name for name in contents if ".dist-info/" not in name}
    command = ["git", "ls-files", "edge"]
    tracked = subprocess.check_output(command, cwd=CHECKOUT, text=True)
    assert inside == set(tracked.split())


def test_the_demo_decides_rightly_and_meets_its_golden_outputs(command):
    result = command("demo")
    assert result.returncode == 0, result.stderr
    assert result.stderr.startswith("12 of 12 decisions are right")
    where = command("-c", "import edge.demo; print(edge.demo.MODEL)", program="python")
    golden = CHECKOUT / "tests" / "golden" / "demo.npz"
    result = command("verify", "--model", where.stdout.strip(), "--golden", golden)
    assert result.returncode == 0, result.stderr


def test_numpy_runs_the_models_where_onnxruntime_is_missing(bare_command, exported):
    assert bare_command("-c", "import onnxruntime", program="python").returncode != 0
    result = bare_command("demo")
    assert result.returncode == 0, result.stderr
    assert result.stderr.count("numpy runs the model, with the same bits") == 1
    files = ("--model", exported / "model.onnx", "--golden", exported / "golden.npz")
    result = bare_command("verify", *files)
    assert result.returncode == 0, result.stderr
    passed = [json.loads(line)["passed"] for line in result.stdout.splitlines()]
    assert passed
    assert all(passed)
