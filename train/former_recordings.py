"""Recordings, and a table of labels, that a folder held before others were written into
it."""

from collections.abc import Iterable, Iterator
from pathlib import Path

from edge.record.labels import read_table
from edge.record.saving import recordings_in


def warnings(folder: Path, written: Iterable[Path]) -> Iterator[str]:
    """A sentence where recordings of a folder are none of those just written, and one
    where its table labels some of these.

    Whoever takes the folder as one data set takes the others as well, and the table's
    labels.
    """
    of_now = set(written)
    table = read_table(folder)
    labelled = table.rows.keys() & {path.name for path in of_now}
    if labelled:
        yield (
            f"warning: {table.path} has rows for {len(labelled)} of them, which win over "
            "their own labels; delete it, unless they are meant"
        )
    former = [path for path in recordings_in(folder) if path not in of_now]
    if former:
        yield (
            f"warning: {folder} holds other recordings too: {len(former)}, such as "
            f"{former[0].name}; take another folder, or delete them, unless they belong "
            "together"
        )
