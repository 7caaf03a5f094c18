"""Debian packages in a folder: fetched with the machine's own apt, without installing anything."""

from __future__ import annotations

import hashlib
import shutil
import subprocess
from collections.abc import Callable, Sequence
from pathlib import Path

APT = """\
APT::Architecture "{architecture}";
APT::Architectures {{ "{architecture}"; }};
APT::Sandbox::User "";
APT::Install-Recommends "false";
Acquire::Languages "none";
Debug::NoLocking "true";
Dir::State "{folder}";
Dir::State::status "{folder}/status";
Dir::Cache "{folder}";
"""
"""An apt of its own: another architecture, nothing installed, no lock, no root."""


class Unavailable(Exception):
    """This machine lacks something that the test needs; the message is a sentence."""


def once(target: Path, wanted: str, make: Callable[[Path], None]) -> None:
    """Make a folder, unless it was made from the same `wanted` before.

    A folder whose making fails is not kept.
    """
    stamp = target / ".made-from"
    digest = hashlib.sha256(wanted.encode()).hexdigest()
    if stamp.is_file() and stamp.read_text() == digest:
        return
    fresh = target.with_name(target.name + ".new")
    for old in (fresh, target):
        shutil.rmtree(old, ignore_errors=True)
    make(fresh)
    (fresh / ".made-from").write_text(digest)
    fresh.rename(target)


def unpack(target: Path, architecture: str, packages: Sequence[str]) -> None:
    """Unpack packages and their dependencies; their installation scripts do not run.

    Raises:
        Unavailable: apt cannot fetch them.
    """
    apt = target.with_name(target.name + ".apt")
    shutil.rmtree(apt, ignore_errors=True)
    for part in ("lists/partial", "archives/partial"):
        (apt / part).mkdir(parents=True)
    (apt / "status").touch()
    config = apt / "apt.conf"
    config.write_text(APT.format(architecture=architecture, folder=apt))
    hint = f"apt cannot fetch {' '.join(packages)} for {architecture}"
    for command in (["update"], ["install", "--download-only", "--yes", *packages]):
        run(["env", f"APT_CONFIG={config}", "apt-get", "--quiet", *command], hint)
    archives = sorted((apt / "archives").glob("*.deb"))
    if not archives:
        raise Unavailable(f"{hint}: nothing came")
    target.mkdir(parents=True)
    for archive in archives:
        run(["dpkg", "--extract", str(archive), str(target)])
    shutil.rmtree(apt)


def output(command: Sequence[str]) -> str:
    """The text that a command prints."""
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


def run(command: Sequence[str], hint: str = "") -> None:
    """Run a command.

    Raises:
        Unavailable: it fails; the sentence has the hint and the command's last words.
    """
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    if done.returncode:
        last = "; ".join((done.stderr.strip() or done.stdout.strip()).splitlines()[-2:])
        raise Unavailable(f"{hint or command[0]}: {last}")
