"""A fitted model to model.onnx and golden.npz; `export.save` is `make export`'s last
step."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from export.api import save

__all__ = ["save"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from importlib import import_module

        return getattr(import_module("export.api"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
