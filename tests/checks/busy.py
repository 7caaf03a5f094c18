"""`make test-busy`: the tests five times beside eight busy processes.

No test may fail because a machine is slow: the exit status is 1 if one did.
"""

import multiprocessing
import os
import shlex
import subprocess
import sys
from contextlib import contextmanager

RUNS = 5
BUSY = 8


def spin(parent):
    """Keep a processor busy as long as the process that started this lives."""
    while os.getppid() == parent:
        pass


@contextmanager
def busy(count):
    """So many processes that compute, until the block is left."""
    parent = os.getpid()
    processes = [
        multiprocessing.Process(target=spin, args=[parent]) for _ in range(count)
    ]
    for process in processes:
        process.start()
    try:
        yield
    finally:
        for process in processes:
            process.kill()


def main():
    """Run the command of the arguments again and again; 1 if a run failed."""
    failures = 0
    with busy(BUSY):
        for number in range(1, RUNS + 1):
            run = subprocess.run(sys.argv[1:], stdout=subprocess.PIPE, text=True)
            failures += run.returncode != 0
            if run.returncode != 0:
                print(run.stdout)
            *_, last = run.stdout.splitlines() or [f"status {run.returncode}"]
            print(f"run {number} of {RUNS}: {last}", flush=True)
    print(f"{failures} of {RUNS} runs of {shlex.join(sys.argv[1:])} failed")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
