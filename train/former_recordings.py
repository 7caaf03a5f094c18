"""Recordings that a folder held before others were written into it."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from edge.saving import recordings_in


def warnings(folder: Path, written: Iterable[Path]) -> Iterator[str]:
    """A sentence where recordings of a folder are none of those just written.

    Whoever takes the folder as one data set takes these as well.
    """
    of_now = set(written)
    former = [path for path in recordings_in(folder) if path not in of_now]
    if former:
        yield (
            f"warning: {folder} holds other recordings too: {len(former)}, such as "
            f"{former[0].name}; take another folder, or delete them, unless they belong "
            "together"
        )
