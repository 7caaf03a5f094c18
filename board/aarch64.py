"""An aarch64 Linux without a board: Debian's Python under qemu, in a folder, without root.

`build` fetches qemu and an arm64 Python with the machine's own apt, and the aarch64 wheels with
pip. It installs nothing on the machine, and uses again what an earlier run has fetched. The result,
`build/aarch64/python`, shows whether wheels load and numbers agree; it says nothing about time.
"""

from __future__ import annotations

import shutil
import sys
import zipfile
from pathlib import Path

from debian import once, run, unpack

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parent
FOLDER = CHECKOUT / "build" / "aarch64"
CPU = "cortex-a72"
"""The Raspberry Pi 4's: nothing may need the instructions that newer boards add."""
EMULATOR = ("qemu-user",)
SYSTEM = ("python3-minimal", "libpython3-stdlib", "libstdc++6", "libgomp1")
BOARD = ("numpy", "onnxruntime", "smbus2")
TESTING = "hypothesis joblib mpmath onnx psutil pytest pytest-xdist scipy tqdm".split()
PLATFORMS = ("manylinux2014", "manylinux_2_17", "manylinux_2_27", "manylinux_2_28")

CPUINFO = """\
processor\t: 0
BogoMIPS\t: 108.00
Features\t: fp asimd evtstrm crc32 cpuid
CPU implementer\t: 0x41
CPU architecture: 8
CPU variant\t: 0x0
CPU part\t: 0xd08
CPU revision\t: 3

Model\t\t: Raspberry Pi 4 Model B Rev 1.4
"""
"""ONNX Runtime reads /proc/cpuinfo, and crashes on one of another architecture."""

WRAPPER = """\
#!/bin/sh
# QEMU_COUNT names a file: instructions executed are then counted into it (see count.c).
exec '{loader}' --library-path '{libraries}' '{emulator}' \\
  ${{QEMU_COUNT:+-plugin "{folder}/count.so,out=$QEMU_COUNT"}} \\
  -cpu {cpu} -0 '{folder}/python' -L '{folder}/root' \\
  -E PYTHONPATH="{folder}/wheel:{folder}/site${{PYTHONPATH:+:$PYTHONPATH}}" -E PYTHONNOUSERSITE=1 \\
  -E PYTHONDONTWRITEBYTECODE=1 '{python}' "$@"
"""


def build(wheel: Path, folder: Path = FOLDER) -> Path:
    """Make the root unless it exists, put the wheel in, and return its `python`.

    Raises:
        Unavailable: apt, a compiler or a package registry is missing here.
    """
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    native = run(["dpkg", "--print-architecture"])
    once(folder / "qemu", "\n".join(EMULATOR), lambda at: unpack(at, native, EMULATOR))
    once(folder / "root", "\n".join(SYSTEM) + CPUINFO, _root)
    python = max(
        (folder / "root" / "usr" / "bin").glob("python3.[0-9]*"),
        key=lambda path: int(path.name.removeprefix("python3.")),
    )
    version = python.name.removeprefix("python")
    constraints = CHECKOUT / "constraints.txt"
    wanted = "\n".join([version, *BOARD, *TESTING, constraints.read_text()])
    once(folder / "site", wanted, lambda at: _site(at, version, constraints))
    shutil.rmtree(folder / "wheel", ignore_errors=True)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "wheel")
    plugin = folder / "count.so"
    run(["cc", "-O2", "-Wall", "-shared", "-fPIC", "-o", str(plugin), str(HERE / "count.c")])
    return _wrapper(folder, python)


def _root(target: Path) -> None:
    unpack(target, "arm64", SYSTEM)
    (target / "proc").mkdir(exist_ok=True)
    (target / "proc" / "cpuinfo").write_text(CPUINFO)


def _site(target: Path, version: str, constraints: Path) -> None:
    tags = [f"--platform={platform}_aarch64" for platform in PLATFORMS]
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    into = ["--target", str(target), "--only-binary=:all:", "--implementation=cp"]
    into += [*tags, "--python-version", version, "-c", str(constraints)]
    run([*pip, *into, *BOARD, *TESTING], "pip cannot fetch the aarch64 wheels")


def _wrapper(folder: Path, python: Path) -> Path:
    """Write the script that runs the root's Python.

    Python takes the script for its own executable, so that a test that starts Python gets the same.
    """
    qemu = folder / "qemu"
    loader = next(path for at in ("lib64", "lib") for path in qemu.glob(f"{at}/ld-linux*"))
    libraries = {str(path.parent) for path in qemu.rglob("*-linux-gnu*/lib*.so.*")}
    wrapper = folder / "python"
    wrapper.write_text(
        WRAPPER.format(
            loader=loader,
            libraries=":".join(libraries),
            emulator=qemu / "usr" / "bin" / "qemu-aarch64",
            cpu=CPU,
            folder=folder,
            python=python,
        )
    )
    wrapper.chmod(0o755)
    run([str(wrapper), "-c", ""], "qemu does not run here")
    return wrapper
