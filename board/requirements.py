"""The packages that a board installs, pinned with hashes: `requirements-board.txt`.

`python -m board.requirements` asks pip which versions each kind of board would install under
`constraints.txt`, and writes them with their SHA-256 sums for
`pip install --require-hashes --only-binary :all: -r requirements-board.txt`.
With `--check-constraints` it checks instead that `constraints.txt` pins every package that the
project and its dependency groups need, and no other.
"""

from __future__ import annotations

import json
import re
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
INSTALLERS = ("pip", "setuptools")
"""Pinned for the Makefile, which installs them itself."""
HEADER = """\
# What edge-classify needs on a board, for Python 3.11 to 3.13 on aarch64 and x86_64 (made by
# `make requirements-board.txt`; the versions are those of constraints.txt):
#
#   pip install --require-hashes --only-binary :all: -r requirements-board.txt
#   pip install --no-deps edge_classify-*.whl
"""


def resolve(*wanted: str) -> list[Mapping[str, Any]]:
    """The packages that `pip install` with these arguments would install; it installs nothing."""
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run"]
        command += ["--ignore-installed", "--disable-pip-version-check", "--target", folder]
        command += ["--report", str(report), "-c", str(ROOT / "constraints.txt"), *wanted]
        subprocess.run(command, check=True, cwd=ROOT)
        installed: list[Mapping[str, Any]] = json.loads(report.read_text())["install"]
        return installed


def normal(name: str) -> str:
    """A package's name as PyPI compares it."""
    return re.sub(r"[-_.]+", "-", name).lower()


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


def differences(constraints: str, needed: Iterable[str]) -> list[str]:
    """A line for each package that is needed and not pinned, or pinned and not needed."""
    pins = {normal(name) for name in re.findall(r"^([\w.-]+)==", constraints, re.M)}
    names = {normal(name) for name in (*needed, *INSTALLERS)}
    return [
        *(f"constraints.txt does not pin {name}" for name in sorted(names - pins)),
        *(f"constraints.txt pins {name}, which nothing needs" for name in sorted(pins - names)),
    ]


def main() -> int:
    """Write the file, or check the constraints; 1 where they differ from what is needed."""
    pyproject = tomllib.loads((ROOT / "pyproject.toml").read_text())
    if sys.argv[1:] == ["--check-constraints"]:
        groups = [f"--group={group}" for group in pyproject["dependency-groups"]]
        names = {package["metadata"]["name"] for package in resolve(".", *groups)}
        lines = differences(
            (ROOT / "constraints.txt").read_text(), names - {pyproject["project"]["name"]}
        )
        print("\n".join(lines) or "constraints.txt pins exactly what the groups need")
        return 1 if lines else 0
    reports = []
    for python, machine in product(PYTHONS, MACHINES):
        platforms = [f"--platform={libc}_{machine}" for libc in GLIBC]
        options = ["--only-binary=:all:", f"--python-version={python}", *platforms]
        reports.append(resolve(*options, *pyproject["project"]["dependencies"]))
    with write_whole(OUT) as file:
        file.write(pinned(reports).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
