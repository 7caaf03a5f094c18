"""Other labs' data to recordings: one module a format.

A module `NAME.py` here is `python -m train import NAME FILE --out DIR`. It has a docstring, whose
first line is the help, and

    def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]

which yields each trial's file name (without `.npz`) and recording, and raises
`edge.errors.InputError` if the file is not what it expects. `arm` is the one that the user names,
for formats that carry joint angles.
"""

from __future__ import annotations

import pkgutil


def names() -> list[str]:
    """The formats that can be imported."""
    return sorted(module.name for module in pkgutil.iter_modules(__path__))
