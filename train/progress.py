"""Progress on stderr."""

import sys
from collections.abc import Iterable
from typing import Any

from tqdm import tqdm

from edge.errors import printable

LOG_S = 10.0
"""Between two lines of progress in a log."""


def bar(iterable: Iterable[Any] | None = None, **options: Any) -> Any:
    """A progress bar; where stderr is no terminal, a line every ten seconds at most.

    Args:
        iterable: the items to work through; None where `update` counts.
        options: of tqdm.
    """
    if not sys.stderr.isatty():
        options = {
            "delay": LOG_S,
            "mininterval": LOG_S,
            "maxinterval": LOG_S,
            **options,
        }
    return tqdm(iterable, **options)


def say(text: str) -> None:
    """Print a line on stdout, above a progress bar, without control characters."""
    text = printable(text)
    if sys.stderr.isatty():
        tqdm.write(text, file=sys.stdout)
    else:
        print(text, flush=True)
