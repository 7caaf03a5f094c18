"""Progress on stderr."""

import logging
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from tqdm import tqdm

from edge.errors import printable

LOG = logging.getLogger(__name__)
LOG_S = 10.0
"""Between two lines of progress in a log."""
FIRST_S = 2.0
"""Before the first line of a step. A shorter step has none."""


def bar(iterable: Iterable[Any] | None = None, **options: Any) -> Any:
    """A progress bar; where stderr is no terminal, a line every ten seconds.

    Args:
        iterable: the items to work through; None where `update` counts.
        options: of tqdm.
    """
    if sys.stderr.isatty() or options.get("disable"):
        return tqdm(iterable, **options)
    often = {"delay": FIRST_S, "mininterval": LOG_S, "maxinterval": LOG_S}
    progress = tqdm(iterable, file=LogLines(), position=0, **often, **options)
    progress.last_print_t -= LOG_S - FIRST_S
    return progress


Stage = Callable[[str], AbstractContextManager[None]]
"""Gives the context of a stage by its name."""


@contextmanager
def stages(seconds: Mapping[str, float], shown: bool) -> Iterator[Stage]:
    """A bar over the stages of a program, with the time that is left of all; the log says
    how long each took.

    Args:
        seconds: {stage: about how long it takes}.
        shown: show the bar.
    """
    form = "{desc}: {percentage:3.0f}% [{elapsed}<{remaining}]"
    total = sum(seconds.values())
    with bar(total=total, desc="export", disable=not shown, bar_format=form) as left:

        @contextmanager
        def stage(name: str) -> Iterator[None]:
            begun = time.monotonic()
            yield
            LOG.debug("%s: %.1f s", name, time.monotonic() - begun)
            left.update(seconds[name])

        yield stage


class LogLines:
    """Stderr where each state of a bar is a line of its own."""

    def write(self, text: str) -> None:
        """Write a bar, without what returns to the beginning of its line."""
        if text.strip():
            print(text.strip(), file=sys.stderr, flush=True)


def announce(text: str) -> None:
    """Print a line on stderr, above a progress bar."""
    tqdm.write(printable(text), file=sys.stderr)


def say(text: str) -> None:
    """Print a line on stdout, above a progress bar, without control characters."""
    tqdm.write(printable(text), file=sys.stdout)
    sys.stdout.flush()
