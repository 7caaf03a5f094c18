"""The packages that a board installs, pinned with hashes: `requirements-board.txt`.

`python -m board.requirements` asks pip to resolve the wheel's own dependencies for each kind of
board, as `constraints.txt` pins them, and writes versions and SHA-256 sums for
`pip install --require-hashes --only-binary :all: -r requirements-board.txt`.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable, Mapping
from itertools import product
from pathlib import Path
from typing import Any

from edge.files import write_whole

ROOT = Path(__file__).parents[1]
OUT = ROOT / "requirements-board.txt"
PYTHONS = ("3.11", "3.12", "3.13")
MACHINES = ("aarch64", "x86_64")
GLIBC = ("manylinux_2_28", "manylinux_2_27", "manylinux2014", "manylinux_2_17")
HEADER = """\
# What edge-classify needs on a board, for Python 3.11 to 3.13 on aarch64 and x86_64 (made by
# `make requirements-board.txt`; the versions are those of constraints.txt):
#
#   pip install --require-hashes --only-binary :all: -r requirements-board.txt
#   pip install --no-deps edge_classify-*.whl
"""


def resolve(wanted: Iterable[str], python: str, machine: str) -> list[Mapping[str, Any]]:
    """What pip would install on one kind of board; nothing is installed."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run"]
        command += ["--ignore-installed", "--disable-pip-version-check", "--only-binary", ":all:"]
        command += ["--target", folder, "--report", str(report), "--python-version", python]
        command += ["-c", str(ROOT / "constraints.txt")]
        for libc in GLIBC:
            command += ["--platform", f"{libc}_{machine}"]
        subprocess.run([*command, *wanted], check=True)
        installed: list[Mapping[str, Any]] = json.loads(report.read_text())["install"]
        return installed


def pinned(reports: Iterable[Iterable[Mapping[str, Any]]]) -> str:
    """The text of the file: each package once, with the hashes of its wheels on all boards.

    Raises:
        ValueError: two boards would get different versions of a package.
    """
    versions: dict[str, str] = {}
    hashes: dict[str, set[str]] = {}
    for package in (package for report in reports for package in report):
        name, version = package["metadata"]["name"].lower(), package["metadata"]["version"]
        if versions.setdefault(name, version) != version:
            raise ValueError(f"{name}: {versions[name]} for one board, {version} for another")
        digest = package["download_info"]["archive_info"]["hashes"]["sha256"]
        hashes.setdefault(name, set()).add(digest)
    lines = [HEADER]
    for name in sorted(versions):
        sums = "".join(f" \\\n    --hash=sha256:{digest}" for digest in sorted(hashes[name]))
        lines.append(f"{name}=={versions[name]}{sums}\n")
    return "".join(lines)


def main() -> None:
    """Write the file."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    text = pinned(resolve(project["dependencies"], *board) for board in product(PYTHONS, MACHINES))
    with write_whole(OUT) as file:
        file.write(text.encode())


if __name__ == "__main__":
    main()
