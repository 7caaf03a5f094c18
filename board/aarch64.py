"""An aarch64 Linux without a board: Debian's Python under qemu, in a folder, without root.

    python board/aarch64.py build dist/edge_classify-*.whl
    build/aarch64/python -m edge.cli --version

`build` fetches qemu and an arm64 Python with the machine's own apt, and the aarch64 wheels with
pip; nothing is installed on the machine. What is there from the last time is used again. It
proves wheels and numbers; of time it proves nothing.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from debian import Unavailable, once, output, run, unpack

HERE = Path(__file__).resolve().parent
CHECKOUT = HERE.parent
FOLDER = CHECKOUT / "build" / "aarch64"
CPU = "cortex-a72"
"""The Raspberry Pi 4's: what newer boards add must not be needed."""
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
"""ONNX Runtime reads /proc/cpuinfo, and crashes on that of another architecture."""

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
    """Make the root where it is not there yet, put the wheel in; returns its `python`.

    Raises:
        Unavailable: apt, a compiler or a package registry cannot be had here.
    """
    for tool in ("apt-get", "dpkg", "cc"):
        if shutil.which(tool) is None:
            raise Unavailable(f"{tool} is not on this machine; use a Debian or Ubuntu one")
    folder = folder.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    native = output(["dpkg", "--print-architecture"])
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
    source = HERE / "count.c"
    run(["cc", "-O2", "-Wall", "-shared", "-fPIC", "-o", str(folder / "count.so"), str(source)])
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
    """The program that runs the root's Python.

    To Python it is its own executable, so that a test that starts another Python gets the same.
    """
    qemu = folder / "qemu"
    loaders = [p for at in ("lib64", "lib") for p in sorted(qemu.glob(f"{at}/ld-linux*"))]
    libraries = sorted({p.parent for p in qemu.rglob("*-linux-gnu*/lib*.so.*")})
    wrapper = folder / "python"
    wrapper.write_text(
        WRAPPER.format(
            loader=loaders[0],
            libraries=":".join(map(str, libraries)),
            emulator=qemu / "usr" / "bin" / "qemu-aarch64",
            cpu=CPU,
            folder=folder,
            python=python,
        )
    )
    wrapper.chmod(0o755)
    try:
        machine = output([str(wrapper), "-c", "import os; print(os.uname().machine)"])
    except (OSError, subprocess.CalledProcessError) as error:
        raise Unavailable(f"qemu does not run here: {error}") from None
    if machine != "aarch64":
        raise Unavailable(f"qemu runs a machine of {machine}, not aarch64")
    return wrapper


def main() -> int:
    """Build from the command line; 2 where that cannot be done here."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    commands = parser.add_subparsers(required=True)
    command = commands.add_parser("build", help="make the root and put the wheel in")
    command.add_argument("wheel", type=Path)
    arguments = parser.parse_args()
    try:
        print(build(arguments.wheel))
    except Unavailable as error:
        print(f"aarch64: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
