"""Linear algebra takes one thread within the block, and as many as before after it.
Processes ignore Ctrl-C, and end when their parent does."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from joblib import delayed
from threadpoolctl import threadpool_info, threadpool_limits

import train.threads as threads_module
from edge.errors import InputError
from train.threads import in_processes, on_cluster, single_thread

ROOT = Path(__file__).parents[2]


def threads():
    """Threads of each library of linear algebra in this process."""
    return {
        pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"
    }


def test_linear_algebra_takes_one_thread_within_the_block():
    np.eye(2) @ np.eye(2)
    with threadpool_limits(2):
        with single_thread():
            assert threads() == {1}
        assert threads() == {2}


def blocked(_):
    """The signals that are blocked where this runs."""
    return signal.pthread_sigmask(signal.SIG_BLOCK, ())


def test_ctrl_c_reaches_the_parent_alone():
    results = in_processes(2, [delayed(blocked)(i) for i in range(2)])
    assert all(signal.SIGINT in masks for masks in results)
    assert signal.SIGINT not in blocked(0)


WORKING = """
import time
from joblib import delayed
from train.threads import in_processes
pauses = (delayed(time.sleep)(seconds) for seconds in (0.0, 0.0, 600.0, 600.0))
for _ in in_processes(2, list(pauses)):
    print("working", flush=True)
"""


def living(group):
    """The processes of a group that have not ended."""
    stats = [path.read_text() for path in Path("/proc").glob("[0-9]*/stat")]
    fields = [stat.rpartition(")")[2].split() for stat in stats]
    return sum(int(f[2]) == group and f[0] != "Z" for f in fields)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs Linux")
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGKILL])
def test_no_process_outlives_the_program_that_began_it(number):
    program = subprocess.Popen(
        [sys.executable, "-c", WORKING],
        cwd=ROOT,
        env={**os.environ, "LOKY_MAX_CPU_COUNT": "2"},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )
    with program:
        for _ in range(2):
            program.stdout.readline()
        assert living(program.pid) > 2
        program.send_signal(number)
        program.wait(60)
        for _ in range(600):
            if living(program.pid) == 0:
                break
            time.sleep(0.1)
    assert living(program.pid) == 0


def test_a_scheduler_that_does_not_answer_is_named(monkeypatch):
    pytest.importorskip("distributed", reason="the group cluster is missing")
    monkeypatch.setattr(threads_module, "ANSWERS_WITHIN_S", 0.2)
    with (
        pytest.raises(InputError, match=r"--cluster tcp://127.0.0.1:1: no Dask"),
        on_cluster("tcp://127.0.0.1:1"),
    ):
        pass


def test_a_cluster_without_dask_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(InputError, match="pip install --group cluster"),
        on_cluster("tcp://127.0.0.1:1"),
    ):
        pass
