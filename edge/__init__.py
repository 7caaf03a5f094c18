"""What the board runs: from the skin's taxels to a decision about the thing touched.

The names below are the public ones, and each is loaded when it is first used: `import edge` alone
takes next to no time. Everything else may move.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from edge.classifier import Classifier
    from edge.errors import EdgeError, InputError
    from edge.events import Decided, Onset, Release
    from edge.model.model import Decision, Model
    from edge.recording import Recording, load, save
    from edge.skin.skin import Skin
    from edge.touch.arm import Chain
    from edge.touch.features import feature_vector
    from edge.touch.region import find_regions, largest_region

__version__ = "0.1.0"

__all__ = [
    "Chain",
    "Classifier",
    "Decided",
    "Decision",
    "EdgeError",
    "InputError",
    "Model",
    "Onset",
    "Recording",
    "Release",
    "Skin",
    "feature_vector",
    "find_regions",
    "largest_region",
    "load",
    "save",
]

_HOMES = {
    "Chain": "edge.touch.arm",
    "Classifier": "edge.classifier",
    "Decided": "edge.events",
    "Decision": "edge.model.model",
    "EdgeError": "edge.errors",
    "InputError": "edge.errors",
    "Model": "edge.model.model",
    "Onset": "edge.events",
    "Recording": "edge.recording",
    "Release": "edge.events",
    "Skin": "edge.skin.skin",
    "feature_vector": "edge.touch.features",
    "find_regions": "edge.touch.region",
    "largest_region": "edge.touch.region",
    "load": "edge.recording",
    "save": "edge.recording",
}


def __getattr__(name: str) -> Any:
    home = _HOMES.get(name)
    if home is None:
        raise AttributeError(f"module 'edge' has no attribute {name!r}")
    value = globals()[name] = getattr(import_module(home), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
