"""Converts other labs' data to recordings, with one module for each format.

Data goes through four rooms: a form (`forms/`: which of the known ones is the file, and
its tables), columns (what each means), counts (rest, sign, scale, what is missing) and
labels. Then a person has a look (`look`), and the recordings are written.

A module `NAME.py` here adds `python -m train import NAME FILE --out DIR`. It has

    def trials(path: Path, arm: Chain | None = None) -> Iterator[ImportedTrial | Refused]

which yields each trial, and a sentence for each file or trial that is left out, and
raises `edge.errors.InputError` if the file is not of the format. `arm` is the one that
the user names, for formats with joint angles. A format with options of its own also has
`add_options(parser)`; its `trials` then gets the parsed options as a third argument.
"""

import pkgutil
from dataclasses import dataclass
from typing import NamedTuple

from edge.record.recording import Recording

SHARED = {
    "axes",
    "clock",
    "columns",
    "counts",
    "forms",
    "labels",
    "look",
    "options",
    "table",
    "topics",
}
"""Modules that the formats share."""


class ImportedTrial(NamedTuple):
    """A trial by the name of its file, without `.npz`."""

    name: str
    recording: Recording


@dataclass(frozen=True)
class Refused:
    """Files that are left out: a sentence names each and says why."""

    sentence: str


def names() -> list[str]:
    """The formats that can be imported."""
    modules = {module.name for module in pkgutil.iter_modules(__path__)}
    return sorted(modules - SHARED)
