"""The machine that the program runs on, beside the needs of a board."""

import grp
import os
import platform
import shutil
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from edge import __version__
from edge.decide.info import FORMAT

PACKAGES = ("numpy", "onnxruntime", "smbus2")
GROUPS = {"i2c-*": "i2c", "ttyACM*": "dialout", "ttyUSB*": "dialout"}
"""Group that may use the devices of each name."""
LEAST_FREE_MB = 200
"""A trial of 384 taxels takes about 0.1 MB."""


@dataclass(frozen=True)
class Fact:
    """A fact about the machine, with a remedy where it will not do."""

    name: str
    value: str
    remedy: str = ""


def look(root: Path = Path("/")) -> Iterator[Fact]:
    """Everything that a board needs, row by row.

    Args:
        root: holds `dev` and `sys`.
    """
    yield Fact(
        "program", f"edge-classify {__version__}; reads models of format {FORMAT}"
    )
    system = f"{platform.system()} {platform.release()}, {platform.machine()}"
    yield Fact("system", system)
    yield Fact("python", platform.python_version())
    for package in PACKAGES:
        try:
            yield Fact(package, version(package))
        except PackageNotFoundError:
            if package == "onnxruntime" and sys.maxsize <= 2**32:
                note = "missing; numpy runs the models on this 32-bit system"
                yield Fact(package, note)
            else:
                yield Fact(package, "missing", f"run `pip install {package}`")
    yield from _devices(root)
    yield from _state()


def _state() -> Iterator[Fact]:
    """Clock, load and disk."""
    # A board without a battery for its clock starts in the past.
    behind = time.time() < Path(__file__).stat().st_mtime
    utc = time.strftime("%Y-%m-%d %H:%M UTC", time.gmtime())
    set_clock = "set the clock: `sudo timedatectl set-ntp true`"
    yield Fact("clock", utc, set_clock if behind else "")
    load = os.getloadavg()[0]
    cores = os.cpu_count() or 1
    busy = "end other programs: they delay the frames" if load > cores else ""
    yield Fact("load", f"{load:.1f} on {cores} cores", busy)
    free_mb = shutil.disk_usage(Path.cwd()).free // 1_000_000
    full = "delete old recordings and maps" if free_mb < LEAST_FREE_MB else ""
    yield Fact("disk", f"{free_mb} MB free in this folder", full)


def _devices(root: Path) -> Iterator[Fact]:
    """I2C buses and serial ports, and whether this user may open them."""
    absent = True
    for pattern, group in GROUPS.items():
        for device in sorted((root / "dev").glob(pattern)):
            absent = False
            yield _device(root, device, group)
    if absent:
        yield Fact(
            "/dev/i2c-*",
            "no I2C bus and no serial port",
            "switch I2C on (`sudo raspi-config`, or `sudo modprobe i2c-dev`), or plug "
            "it in",
        )


def _device(root: Path, device: Path, group: str) -> Fact:
    name = root / "sys/class/i2c-dev" / device.name / "name"
    adapter = f"{name.read_text().strip()}, " if name.exists() else ""
    owner = f"{adapter}group {_group(device.stat().st_gid)}"
    remedy = ""
    if not os.access(device, os.R_OK | os.W_OK):
        remedy = (
            f"may not be opened; run `sudo usermod -aG {group} $USER`, and log in again"
        )
    return Fact(f"/dev/{device.name}", owner, remedy)


def _group(number: int) -> str:
    """The name of a group; its number where it has none, as in many containers."""
    try:
        return grp.getgrgid(number)[0]
    except KeyError:
        return str(number)
