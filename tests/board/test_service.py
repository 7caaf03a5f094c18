"""The systemd unit under a real systemd: started, watched, started again, and stopped
for good.

`make service-test` runs this as root; `service_init.sh` starts the systemd.
"""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy
import pytest

from edge import demo
from edge.wire.fake.player import calibrated
from edge.wire.skin import file as skinfile
from edge.wire.skin.calibration import save_calibration
from tests.conftest import ended

HERE = Path(__file__).resolve().parent
SYSTEMD = Path("/lib/systemd/systemd")
UNIT = "edge-classify.service"
FAKE = "--fake /etc/edge-classify/touch.npz --loop --web 127.0.0.1:0"
PROPERTIES = "ActiveState SubState MainPID NRestarts StatusText ExecMainStatus LimitRTTIME".split()


class Machine:
    """The machine of the new systemd, seen from this one."""

    def __init__(self, folder):
        """Start it, with the files of a folder as those of the service."""
        python = Path(sys.executable).resolve().name
        packages = Path(numpy.__file__).parents[1]
        variables = {"BASE": sys.base_prefix, "PYTHON": python, "PACKAGES": packages}
        variables |= {"CHECKOUT": HERE.parents[1], "FOLDER": folder, "SYSTEMD": SYSTEMD}
        command = ["env", *(f"{name}={value}" for name, value in variables.items())]
        unshare = "unshare --pid --fork --mount --mount-proc --uts --kill-child"
        command += [*unshare.split(), HERE / "service_init.sh"]
        self.process = subprocess.Popen(command, stdin=subprocess.DEVNULL)
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        (self.first,) = self.once(lambda: children.read_text().split(), len)
        self.root = Path(f"/proc/{self.first}/root")
        # Before that, /run and its sockets are this machine's, and so is the systemd
        # behind them.
        name = Path(f"/proc/{self.first}/comm")
        assert self.once(name.read_text, "systemd\n".__eq__) == "systemd\n"
        state = "systemctl is-active multi-user.target".split()
        self.once(lambda: self.run(*state), "active\n".__eq__)

    def run(self, *command):
        """What a command prints there."""
        enter = f"nsenter --target {self.first} --pid --mount --uts".split()
        return ended(*enter, *command).stdout

    def once(self, look, fits, seconds=300.0):
        """The first observation that fits, or else the last one."""
        ends = time.monotonic() + seconds
        while not fits(state := look()) and time.monotonic() < ends:
            assert self.process.poll() is None, "systemd did not start"
            time.sleep(0.2)
        return state

    def properties(self):
        """The unit's properties."""
        options = (f"--property={name}" for name in PROPERTIES)
        lines = self.run("systemctl", "show", UNIT, *options).splitlines()
        return dict(line.split("=", 1) for line in lines)

    def wait_for(self, **expected):
        """The unit's properties once they are as expected, or the last ones."""
        keys = expected.items()
        return self.once(self.properties, lambda state: keys <= state.items())

    def restart(self, arguments):
        """Start the service anew with these arguments."""
        environment = self.root / "etc" / "edge-classify" / "edge-classify.env"
        environment.write_text(f'ARGUMENTS="{arguments}"\n')
        self.run("systemctl", "reset-failed", UNIT)
        self.run("systemctl", "restart", "--no-block", UNIT)


@pytest.fixture(scope="module")
def machine(tmp_path_factory):
    if not (SYSTEMD.exists() and shutil.which("unshare") and os.geteuid() == 0):
        pytest.skip("a systemd of its own needs systemd, unshare and root")
    folder = tmp_path_factory.mktemp("service")
    shutil.copy(demo.MODEL, folder / "model.onnx")
    shutil.copy(demo.FOLDER / "cardboard-box-fixed.npz", folder / "touch.npz")
    skin = shutil.copy(skinfile.shipped("cody"), folder / "skin.toml")
    save_calibration(skin, calibrated(skinfile.load(skin)).calibration)
    machine = Machine(folder)
    yield machine
    machine.process.kill()
    machine.process.wait()


@pytest.fixture(scope="module")
def started(machine):
    """The unit's properties once it runs."""
    machine.restart(FAKE)
    return machine.wait_for(ActiveState="active")


def test_the_unit_is_valid(machine):
    verify = f"systemd-analyze verify /run/units/{UNIT} 2>&1; echo $?"
    printed = machine.run("bash", "-c", verify)
    assert printed.splitlines()[-1] == "0", printed


def test_it_is_active_once_it_reads_the_skin_as_a_user_without_rights(machine, started):
    assert started["ActiveState"] == "active"
    assert started["NRestarts"] == "0"
    assert started["StatusText"] == "reading fake /etc/edge-classify/touch.npz"
    file = machine.root / "proc" / started["MainPID"] / "status"
    status = dict(line.split(":\t", 1) for line in file.read_text().splitlines())
    assert int(status["Uid"].split()[0]) >= 61184  # of the range of dynamic users
    assert status["CapEff"].strip() == "0000000000000000"


def test_the_drop_in_gives_it_a_real_time_priority_with_a_limit(machine, started):
    schedule = machine.run("chrt", "--pid", started["MainPID"]).splitlines()
    assert [line.split(": ")[1] for line in schedule] == ["SCHED_FIFO", "10"]
    assert started["LimitRTTIME"] == "10000000"


def test_a_loop_that_stands_still_is_started_again(machine, started):
    machine.run("kill", "-STOP", started["MainPID"])
    expected = {"ActiveState": "active", "NRestarts": "1"}
    hung = machine.wait_for(**expected)
    assert expected.items() <= hung.items()
    assert hung["MainPID"] != started["MainPID"]


def test_a_device_that_is_missing_is_tried_again(machine):
    machine.restart("--without-joints skin")
    expected = {"SubState": "auto-restart", "ExecMainStatus": "3"}
    missing = machine.wait_for(**expected)
    assert expected.items() <= missing.items()


def test_a_mistake_in_the_arguments_is_not(machine):
    machine.restart(f"{FAKE} --error 2")
    mistaken = machine.wait_for(SubState="failed")
    assert mistaken["SubState"] == "failed"
    assert mistaken["ExecMainStatus"] == "2"
    log = (machine.root / "run" / "log").read_text()
    assert "the error rate must be" in log.splitlines()[-1]
