"""Several processes, each with one thread for linear algebra: on matrices as small as
ours several threads are slower."""

import signal
from collections.abc import Iterator, Sequence
from functools import cache
from multiprocessing import resource_tracker
from typing import Any

from joblib import Parallel
from threadpoolctl import ThreadpoolController

from train.progress import bar


@cache
def _controller() -> Any:
    # Looking for the process's libraries takes longer than many a fit.
    return ThreadpoolController()


def single_thread() -> Any:
    """A context in which linear algebra takes one thread."""
    return _controller().limit(limits=1)


def in_processes(
    jobs: int,
    calls: Sequence[Any],
    heading: str = "",
    **options: Any,
) -> Iterator[Any]:
    """The results of calls that joblib delays, in their order, by so many processes.

    With a heading, a bar shows how many are there.

    Ctrl-C ends this process, which ends the others: those that begin here never get the
    signal, which would print their tracebacks. The options are those of joblib.
    """
    run = Parallel(n_jobs=jobs, return_as="generator", **options)
    can_block = hasattr(signal, "pthread_sigmask")  # Windows cannot
    if can_block:
        resource_tracker.ensure_running()  # its start would end the block
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        results = run(calls)
    finally:
        if can_block:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    return iter(bar(results, total=len(calls), desc=heading, disable=not heading))
