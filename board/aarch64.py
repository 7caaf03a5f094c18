"""An aarch64 Linux without a board: Debian's Python under qemu, in a folder, without root.

qemu and an arm64 Python come with the machine's own apt, and the aarch64 wheels with pip. Nothing
is installed on the machine. The emulated Python shows whether wheels load and numbers agree; it
says nothing about time.
"""

from __future__ import annotations

import shutil
import sys
import zipfile
from pathlib import Path

from board.debian import CHECKOUT, once, program, run, unpacked

FOLDER = CHECKOUT / "build" / "aarch64"
CPU = "cortex-a72"
"""The Raspberry Pi 4's: nothing may need the instructions that newer boards add."""
SYSTEM = ("python3-minimal", "libpython3-stdlib", "libstdc++6", "libgomp1")
PACKAGES = ("numpy", "onnxruntime", "smbus2")
PLATFORMS = ("manylinux2014", "manylinux_2_17", "manylinux_2_27", "manylinux_2_28")
CPUINFO = CHECKOUT / "board" / "cpuinfo"
"""A Raspberry Pi 4's. ONNX Runtime reads it, and crashes on one of another architecture."""


def python(wheel: Path, counts: Path) -> list[str]:
    """The command of an emulated Python that has the wheel and its dependencies.

    Args:
        wheel: of edge-classify.
        counts: a file for the numbers of executed instructions (see count.c).

    Raises:
        Unavailable: apt, a compiler or a package registry is missing here.
    """
    native = run(["dpkg", "--print-architecture"])
    qemu = unpacked(FOLDER / "qemu", native, ["qemu-user"])
    root = unpacked(FOLDER / "root", "arm64", SYSTEM)
    (root / "proc").mkdir(exist_ok=True)
    shutil.copy(CPUINFO, root / "proc")
    executable = next((root / "usr" / "bin").glob("python3.[0-9]*"))
    version = executable.name.removeprefix("python")
    constraints = CHECKOUT / "constraints.txt"

    def install(site: Path) -> None:
        pip = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
        kind = ["--only-binary=:all:", "--implementation=cp", "--python-version", version]
        kind += [f"--platform={platform}_aarch64" for platform in PLATFORMS]
        command = [*pip, *kind, "-c", str(constraints), "--target", str(site), *PACKAGES]
        run(command, "pip cannot fetch the aarch64 wheels")

    site = once(FOLDER / "site", "\n".join([version, constraints.read_text()]), install)
    shutil.rmtree(FOLDER / "wheel", ignore_errors=True)
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(FOLDER / "wheel")
    plugin, source = FOLDER / "count.so", CHECKOUT / "board" / "count.c"
    run(["cc", "-O2", "-Wall", "-shared", "-fPIC", "-o", str(plugin), str(source)])
    variables = (f"PYTHONPATH={FOLDER}/wheel:{site}", "PYTHONNOUSERSITE=1", "PYTHONHASHSEED=0")
    command = [*program(qemu, "qemu-aarch64"), "-plugin", f"{plugin},out={counts}"]
    command += ["-cpu", CPU, "-L", str(root), *(word for v in variables for word in ("-E", v))]
    run([*command, str(executable), "-c", ""], "qemu does not run here")
    return [*command, str(executable)]
