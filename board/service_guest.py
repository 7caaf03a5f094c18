"""What `test_service.py` does to the service beside it, under a systemd of its own.

Prints nothing; writes one JSON object of what it saw.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

UNIT = "edge-classify.service"
ARGUMENTS = Path("/etc/edge-classify/edge-classify.env")
FAKE = "--fake /etc/edge-classify/touch.npz --loop --real-time"
SHOWN = "ActiveState SubState MainPID NRestarts StatusText ExecMainStatus LimitRTTIME".split()


def systemctl(*words):
    """The output of a systemctl command."""
    done = subprocess.run(["systemctl", *words], capture_output=True, text=True, check=False)
    return done.stdout


def shown():
    """The unit's properties."""
    lines = systemctl("show", UNIT, *(f"--property={name}" for name in SHOWN)).splitlines()
    return dict(line.split("=", 1) for line in lines)


def wait_for(seconds=60.0, **wanted):
    """The unit's properties once they are as wanted, or the last ones."""
    ends = time.monotonic() + seconds
    while True:
        seen = shown()
        if wanted.items() <= seen.items() or time.monotonic() > ends:
            return seen
        time.sleep(0.2)


def restart(arguments):
    """Start the service anew with these arguments."""
    ARGUMENTS.write_text(f'ARGUMENTS="{arguments}"\n')
    systemctl("reset-failed", UNIT)
    systemctl("restart", "--no-block", UNIT)


def process(pid):
    """The rights and the schedule of a process."""
    status = dict(
        line.split(":\t", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines()
    )
    return {
        "uid": int(status["Uid"].split()[0]),
        "capabilities": status["CapEff"].strip(),
        "policy": os.sched_getscheduler(pid),
        "priority": os.sched_getparam(pid).sched_priority,
    }


def main():
    """Do the steps, and write what was seen."""
    verify = ["systemd-analyze", "verify", f"/run/units/{UNIT}"]
    done = subprocess.run(verify, capture_output=True, text=True, check=False)
    seen = {"verified": [done.returncode, done.stderr]}
    try:
        restart(FAKE)
        seen["started"] = wait_for(ActiveState="active")
        pid = int(seen["started"]["MainPID"])
        seen["started"] |= process(pid)
        os.kill(pid, signal.SIGSTOP)
        seen["hung"] = wait_for(ActiveState="active", NRestarts="1")
        restart("--without-joints skin")
        seen["missing device"] = wait_for(SubState="auto-restart", ExecMainStatus="3")
        restart(f"{FAKE} --error 2")
        seen["mistaken"] = wait_for(ActiveState="failed")
        time.sleep(3.0)
        seen["mistaken"] = shown()
    finally:
        log = Path("/run/log")
        seen["log"] = log.read_text()[-4000:] if log.exists() else ""
        results = Path(sys.argv[1])
        results.with_suffix(".new").write_text(json.dumps(seen))
        results.with_suffix(".new").rename(results)


if __name__ == "__main__":
    main()
