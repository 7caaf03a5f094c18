"""Recordings that a folder held before others were written into it."""

from collections.abc import Iterable, Iterator
from pathlib import Path


def warnings(folder: Path, written: Iterable[Path]) -> Iterator[str]:
    """A sentence where recordings of a folder are none of those just written.

    Whoever takes the folder as one data set takes these as well.
    """
    former = sorted(set(folder.rglob("*.npz")) - set(written))
    if former:
        yield (
            f"warning: {folder} holds other recordings too: {len(former)}, such as "
            f"{former[0].name}; take another folder, or delete them, unless they belong "
            "together"
        )
