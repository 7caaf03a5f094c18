"""Debian packages in a folder: fetched with the machine's own apt, without installing
anything."""

import os
import shutil
from contextlib import contextmanager
from pathlib import Path
from string import Template

import pytest

from tests.conftest import ended

CHECKOUT = Path(__file__).resolve().parents[2]
APT = Template((CHECKOUT / "tests" / "board" / "apt.conf").read_text())


class Unavailable(Exception):
    """This machine lacks something that the test needs; the message is a sentence."""


@contextmanager
def skipping():
    """Skip the test where something is unavailable, but not in CI."""
    try:
        yield
    except Unavailable as error:
        if os.environ.get("CI"):
            raise
        pytest.skip(str(error))


def once(target, recipe, make):
    """Make a folder, unless it was made by the same recipe before; a failed one is not
    kept."""
    stamp = target / ".made-from"
    if not (stamp.is_file() and stamp.read_text() == recipe):
        fresh = target.with_name(target.name + ".new")
        for old in (fresh, target):
            shutil.rmtree(old, ignore_errors=True)
        fresh.mkdir(parents=True)
        make(fresh)
        (fresh / stamp.name).write_text(recipe)
        fresh.rename(target)
    return target


def unpacked(target, architecture, packages):
    """A folder with packages and their dependencies; their installation scripts do not
    run.

    Raises:
        Unavailable: apt cannot fetch them.
    """

    def unpack(fresh):
        apt = fresh.with_suffix(".apt")
        shutil.rmtree(apt, ignore_errors=True)
        for folder in ("lists/partial", "archives/partial"):
            (apt / folder).mkdir(parents=True)
        (apt / "status").touch()
        (apt / "apt.conf").write_text(
            APT.substitute(architecture=architecture, folder=apt)
        )
        hint = f"apt cannot fetch {' '.join(packages)} for {architecture}"
        get = ["env", f"APT_CONFIG={apt}/apt.conf", "apt-get", "--quiet"]
        run([*get, "update"], hint)
        run([*get, "install", "--download-only", "--yes", *packages], hint)
        for archive in sorted((apt / "archives").glob("*.deb")):
            run(["dpkg", "--extract", str(archive), str(fresh)])
        shutil.rmtree(apt)

    return once(target, "\n".join((architecture, *packages)), unpack)


def program(system, name):
    """The command of a program among unpacked packages, with their loader and
    libraries."""
    loader = next(system.glob("lib*/ld-linux*"))
    libraries = {str(path.parent) for path in system.rglob("*-linux-gnu*/lib*.so.*")}
    paths = ["--library-path", ":".join(libraries)]
    return [str(loader), *paths, f"{system}/usr/bin/{name}"]


def run(command, hint=""):
    """The text that a command prints.

    Raises:
        Unavailable: it fails; the sentence has the hint and the command's last words.
    """
    try:
        process = ended(*command)
    except FileNotFoundError:
        raise Unavailable(
            f"{command[0]} is not on this machine; use Debian or Ubuntu"
        ) from None
    if process.returncode:
        last = "; ".join(
            (process.stderr.strip() or process.stdout.strip()).splitlines()[-2:]
        )
        raise Unavailable(f"{hint or command[0]}: {last}")
    return process.stdout.strip()
