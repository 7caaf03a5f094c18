"""`edge-classify run` as a service: under a stand-in for systemd's socket, and the unit
itself."""

import os
import shlex
import shutil
import signal
import subprocess
from configparser import ConfigParser
from pathlib import Path

import pytest

from edge import demo
from edge.app.cli import parsed, parser
from tests.conftest import ROOT, lines, started

UNIT = ROOT / "docs" / "examples" / "service" / "edge-classify.service"
TOUCH = demo.FOLDER / "cardboard-box-fixed.npz"


def start(manager, *arguments):
    watched = {"NOTIFY_SOCKET": manager.getsockname(), "WATCHDOG_USEC": "200000"}
    options = ("--model", demo.MODEL, "--fake", TOUCH, "--loop", *arguments)
    environment = {**os.environ, **watched}
    return started("run", *options, env=environment, stdout=subprocess.PIPE)


def said_until_stopping(manager):
    messages = {manager.recv(4096)}
    while b"STOPPING=1" not in messages:
        messages.add(manager.recv(4096))
    return messages


def test_it_says_that_it_is_ready_alive_and_stopping_and_ends_cleanly(manager):
    with start(manager) as process:
        assert manager.recv(4096) == f"READY=1\nSTATUS=reading fake {TOUCH}".encode()
        for _ in range(3):
            assert manager.recv(4096) == b"WATCHDOG=1"
        process.send_signal(signal.SIGTERM)
        out, err = process.communicate(timeout=60)
        messages = said_until_stopping(manager)
    assert messages <= {b"WATCHDOG=1", b"STOPPING=1"}
    assert process.returncode == 0
    assert err == ""
    assert out.endswith("\n")
    assert lines(out)[-1]["event"] == "end"


@pytest.fixture
def unit():
    config = ConfigParser(interpolation=None, delimiters=("=",))
    config.optionxform = str
    config.read(UNIT)
    return config


def examples():
    """The arguments in the unit's environment file: those that hold, and those in a
    comment."""
    lines = UNIT.with_suffix(".env").read_text().splitlines()
    pairs = [line.lstrip("#").partition("=") for line in lines]
    return [value for name, _, value in pairs if name == "ARGUMENTS"]


def test_the_units_command_with_and_without_an_arm_is_one_that_edge_classify_takes(
    unit,
):
    program, *words = shlex.split(unit["Service"]["ExecStart"])
    assert Path(program).name == "edge-classify"
    assert words.pop() == "$ARGUMENTS"
    without, arm = (
        parsed(parser(), [*words, *shlex.split(*shlex.split(e))]) for e in examples()
    )
    assert without.joints is None
    assert arm.joints == "udp:47401"
    folder = Path("/var/lib") / unit["Service"]["StateDirectory"] / "kept"
    assert arm.keep == folder


@pytest.mark.skipif(
    shutil.which("systemd-analyze") is None, reason="no systemd-analyze here"
)
def test_systemd_finds_the_unit_little_exposed():
    options = ["security", "--offline=true", "--threshold=25", str(UNIT)]
    command = ["systemd-analyze", *options]
    process = subprocess.run(command, capture_output=True, text=True, check=False)
    assert process.returncode == 0, process.stdout[-500:]
