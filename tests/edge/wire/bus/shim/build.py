"""Builds the stand-in for /dev/i2c-N that lets an unmodified smbus2 run without
hardware."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

SOURCE = Path(__file__).with_name("i2cdev.c")
ROOT = Path(__file__).parents[5]


def compiler() -> str | None:
    """A C compiler, or None where there is none (or this is not Linux)."""
    return (
        shutil.which("cc") or shutil.which("gcc") if sys.platform == "linux" else None
    )


def build(folder: Path) -> Path:
    """The shim as a library in `folder`."""
    library = folder / "i2cdev.so"
    command = [
        str(compiler()),
        "-O2",
        "-Wall",
        "-Wextra",
        "-Werror",
        "-shared",
        "-fPIC",
    ]
    subprocess.run(
        [*command, "-o", str(library), str(SOURCE), "-ldl", "-lpthread"], check=True
    )
    return library


def environment(library: Path, **more: str) -> dict[str, str]:
    """The environment of a Python that runs over the shim."""
    path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    return {**os.environ, "LD_PRELOAD": str(library), "PYTHONPATH": path, **more}
