"""One thread for linear algebra: on matrices as small as ours several threads are
slower."""

from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController


@cache
def _controller() -> Any:
    # Looking for the process's libraries takes longer than many a fit.
    return ThreadpoolController()


def single_thread() -> Any:
    """A context in which linear algebra takes one thread."""
    return _controller().limit(limits=1)
