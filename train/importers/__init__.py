"""Converts other labs' data to recordings, with one module for each format.

A module `NAME.py` here adds `python -m train import NAME FILE --out DIR`. It has

    def trials(path: Path, arm: Chain | None = None) -> Iterator[tuple[str, Recording]]

which yields each trial's file name (without `.npz`) and recording, and raises
`edge.errors.InputError` if the file is not of the format. `arm` is the one that the
user names, for formats with joint angles. A format with options of its own also has
`add_options(parser)`; its `trials` then gets the parsed options as a third argument.
"""

import pkgutil

SHARED = {"arrays", "axes", "clock", "columns", "counts", "reading", "topics"}
"""Modules that the formats share."""


def names() -> list[str]:
    """The formats that can be imported."""
    modules = {module.name for module in pkgutil.iter_modules(__path__)}
    return sorted(modules - SHARED)
