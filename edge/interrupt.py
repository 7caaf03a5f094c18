"""Ctrl-C while a module is being imported, and a program that is told to end."""

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


def exit_on_sigterm() -> None:
    """SIGTERM then ends the program as an exit does, so that no temporary file is
    left."""
    signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))


@contextmanager
def delayed() -> Iterator[None]:
    """Within the block, Ctrl-C waits for the block's end.

    An import would lose Python's KeyboardInterrupt in a callback, or turn it into an
    ImportError, as the extension modules of numpy and onnxruntime do. Only the main
    thread can delay it.
    """
    handler: Any = signal.getsignal(signal.SIGINT)
    if (
        not callable(handler)
        or threading.current_thread() is not threading.main_thread()
    ):
        yield
        return
    caught: list[tuple[Any, ...]] = []
    signal.signal(signal.SIGINT, lambda *details: caught.append(details))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if caught:
            handler(*caught[0])
