"""The systemd unit under a real systemd: started, watched, started again, and stopped for good.

`make service-test` runs this as root. A systemd of its own, in namespaces of its own, sees this
machine's files, with empty folders over those that the unit and its installation write to.
"""

import json
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy
import pytest

from edge import demo
from edge.fake.player import calibrated
from edge.skin import file as skinfile
from edge.skin.calibration import save_calibration

HERE = Path(__file__).resolve().parent
SYSTEMD = Path("/lib/systemd/systemd")
LONGEST_S = 240

START = """\
set -e
for folder in /run /opt /var/lib; do mount -t tmpfs none $folder; done
mkdir /run/etc /run/work /run/units
mount -t overlay none -o lowerdir=/etc,upperdir=/run/etc,workdir=/run/work /etc
getent group i2c || echo i2c:x:64000: >> /etc/group
mkdir /opt/python /opt/packages /opt/checkout
mount --bind {base} /opt/python
mount --bind {packages} /opt/packages
mount --bind {checkout} /opt/checkout
install -D -m 755 {folder}/edge-classify /opt/edge-classify/bin/edge-classify
install -D -m 644 -t /etc/edge-classify {folder}/model.onnx {folder}/skin.toml {folder}/touch.npz
install -m 644 {here}/edge-classify.service {folder}/*.service {folder}/*.target /run/units
install -D -m 644 -t /run/units/edge-classify.service.d {here}/real-time.conf {folder}/log.conf
export container=edge SYSTEMD_UNIT_PATH=/run/units PATH=/usr/sbin:/usr/bin:/sbin:/bin
exec {systemd} --system --unit=probe.service --show-status=no --log-target=null
"""
COMMAND = """\
#!/bin/sh
export PYTHONPATH=/opt/checkout:/opt/packages PYTHONDONTWRITEBYTECODE=1
exec /opt/python/bin/{python} -m edge "$@"
"""
PROBE = """\
[Unit]
DefaultDependencies=no
[Service]
Type=oneshot
ExecStart=/opt/python/bin/{python} {here}/service_guest.py {folder}/results.json
"""
LOG = "[Service]\nStandardOutput=append:/run/log\nStandardError=append:/run/log\n"
TARGET = "[Unit]\nDefaultDependencies=no\n"


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """{step: what systemd and the kernel said of the service}, of `service_guest.py`."""
    if not (SYSTEMD.exists() and shutil.which("unshare")):
        pytest.skip("this machine has no systemd, or no unshare")
    if os.geteuid() != 0:
        pytest.skip("a systemd of its own needs root")
    folder = tmp_path_factory.mktemp("service")
    names = {
        "base": sys.base_prefix,
        "packages": Path(numpy.__file__).parents[1],
        "checkout": HERE.parent,
        "here": HERE,
        "folder": folder,
        "systemd": SYSTEMD,
        "python": Path(sys.executable).resolve().name,
    }
    shutil.copy(demo.MODEL, folder / "model.onnx")
    shutil.copy(demo.FOLDER / "cardboard-box-fixed.npz", folder / "touch.npz")
    skin = shutil.copy(skinfile.shipped("cody"), folder / "skin.toml")
    save_calibration(skin, calibrated(skinfile.load(skin)).calibration)
    (folder / "edge-classify").write_text(COMMAND.format(**names))
    (folder / "probe.service").write_text(PROBE.format(**names))
    (folder / "log.conf").write_text(LOG)
    for target in ("sysinit", "basic", "shutdown", "multi-user"):
        (folder / f"{target}.target").write_text(TARGET)
    command = "unshare --pid --fork --mount --mount-proc --uts --kill-child bash -c".split()
    machine = subprocess.Popen([*command, START.format(**names)], stdin=subprocess.DEVNULL)
    ends = time.monotonic() + LONGEST_S
    try:
        while not (folder / "results.json").exists():
            assert machine.poll() is None, "systemd did not start"
            assert time.monotonic() < ends, "the steps did not end"
            time.sleep(0.2)
        return json.loads((folder / "results.json").read_text())
    finally:
        machine.kill()
        machine.wait()


def test_the_unit_is_valid(results):
    assert results["verified"][0] == 0, results["verified"]


def test_it_is_active_once_it_reads_the_skin_as_a_user_without_rights(results):
    started = results["started"]
    assert (started["ActiveState"], started["NRestarts"]) == ("active", "0"), started
    assert started["StatusText"] == "reading fake /etc/edge-classify/touch.npz"
    assert started["uid"] >= 61184  # of the range of dynamic users
    assert started["capabilities"] == "0000000000000000"


def test_the_drop_in_gives_it_a_real_time_priority_with_a_limit(results):
    assert (results["started"]["policy"], results["started"]["priority"]) == (os.SCHED_FIFO, 10)
    assert results["started"]["LimitRTTIME"] == "10000000"


def test_a_loop_that_stands_still_is_started_again(results):
    assert (results["hung"]["ActiveState"], results["hung"]["NRestarts"]) == ("active", "1")
    assert results["hung"]["MainPID"] != results["started"]["MainPID"]


def test_a_device_that_is_missing_is_tried_again(results):
    missing = results["missing device"]
    assert (missing["SubState"], missing["ExecMainStatus"]) == ("auto-restart", "3"), missing


def test_a_mistake_in_the_arguments_is_not(results):
    mistaken = results["mistaken"]
    assert (mistaken["ActiveState"], mistaken["ExecMainStatus"]) == ("failed", "2"), mistaken
    assert "the error rate must be" in results["log"].splitlines()[-1]
