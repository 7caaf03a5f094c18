"""Linear algebra takes one thread within the block, and as many as before after it.
Processes ignore Ctrl-C, which ends their parent."""

import signal

import numpy as np
from joblib import delayed
from threadpoolctl import threadpool_info, threadpool_limits

from train.threads import in_processes, single_thread


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
