"""The workstation: recordings to a fitted model.

`train.fit` does from Python what `make export` does; `export.save` writes the result.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from train.fitted import Fitted
    from train.fitting import fit

__all__ = ["Fitted", "fit"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("train.fitting"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
