"""Several processes, each with one thread for linear algebra: on matrices as small as
ours several threads are slower."""

import os
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from multiprocessing import resource_tracker
from threading import Thread
from typing import Any

from joblib import Parallel, parallel_config
from threadpoolctl import ThreadpoolController

from edge.errors import InputError
from train.progress import bar

WATCHED_EVERY_S = 0.5
"""Between two looks at whether the parent still runs."""

ANSWERS_WITHIN_S = 10.0
"""A scheduler does, or there is none."""


@cache
def _controller() -> Any:
    # Looking for the process's libraries takes longer than many a fit.
    return ThreadpoolController()


def single_thread() -> Any:
    """A context in which linear algebra takes one thread."""
    return _controller().limit(limits=1)


def _end_with(parent: int) -> None:
    """End this process soon after its parent has, by whatever signal.

    Linux alone can send a signal then, and sends it for the thread that began the
    process.
    """

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCHED_EVERY_S)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def on_cluster(address: str | None) -> Iterator[None]:
    """A context in which `in_processes` gives its calls to a Dask scheduler, such as
    `tcp://host:8786`; to processes of this machine where None.

    Raises:
        InputError: Dask is missing, or no scheduler answers.
    """
    if address is None:
        yield
        return
    try:
        from distributed import Client  # the group cluster has it
    except ImportError:
        raise InputError(
            "--cluster needs Dask; install it with pip install --group cluster"
        ) from None
    try:
        client = Client(address, timeout=ANSWERS_WITHIN_S, set_as_default=True)
    except (OSError, ValueError):
        raise InputError(
            f"--cluster {address}: no Dask scheduler answers there; start one with "
            "`dask scheduler`, and name its tcp://HOST:PORT"
        ) from None
    with client, parallel_config(backend="dask"):
        yield


def in_processes(
    jobs: int,
    calls: Sequence[Any],
    heading: str = "",
    **options: Any,
) -> Iterator[Any]:
    """The results of calls that joblib delays, in their order, by so many processes.

    With a heading, a bar shows how many are there.

    The others end when this process does, by whatever signal. Those that begin here
    never get that of Ctrl-C, which would print their tracebacks. The options are those
    of joblib.
    """
    watched = {"initializer": _end_with, "initargs": (os.getpid(),)}
    run = Parallel(n_jobs=jobs, return_as="generator", **watched, **options)
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
