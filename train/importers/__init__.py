"""Other labs' data to recordings: one module a format.

A module `NAME.py` here is `python -m train import NAME FILE --out DIR`. It has a docstring, whose
first line is the help, and

    def trials(path: Path) -> Iterator[tuple[str, Recording]]

which yields each trial's file name (without `.npz`) and recording, and raises
`edge.errors.InputError` where the file is not what it expects.
"""

from __future__ import annotations

import pkgutil


def names() -> list[str]:
    """The formats that can be imported."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))
