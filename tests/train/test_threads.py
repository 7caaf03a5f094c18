"""Linear algebra takes one thread within the block, and as many as before after it."""

import numpy as np
from threadpoolctl import threadpool_info, threadpool_limits

from train.threads import single_thread


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
