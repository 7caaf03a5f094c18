"""What the board runs: from the taxels of a skin to a decision about the object it
touches.

Only the names below are public; everything else may move. Each is loaded at its first
use, so that `import edge` alone is quick.
"""

from importlib import import_module

TYPE_CHECKING = (
    False  # type checkers read it as true; to load typing would take longer than edge
)
if TYPE_CHECKING:
    from edge.decide.classifier import Classifier as Classifier
    from edge.decide.events import Decided as Decided
    from edge.decide.events import Onset as Onset
    from edge.decide.events import Release as Release
    from edge.decide.model import Decision as Decision
    from edge.decide.model import Model as Model
    from edge.errors import EdgeError as EdgeError
    from edge.errors import InputError as InputError
    from edge.features.vector import feature_vector as feature_vector
    from edge.record.recording import Recording as Recording
    from edge.record.recording import load as load
    from edge.record.saving import save as save
    from edge.touch.arm import Chain as Chain
    from edge.touch.region import find_regions as find_regions
    from edge.touch.region import largest_region as largest_region
    from edge.wire.skin.skin import Skin as Skin

__version__ = "0.2.0"

_PUBLIC = {
    "edge.decide.classifier": ["Classifier"],
    "edge.errors": ["EdgeError", "InputError"],
    "edge.decide.events": ["Decided", "Onset", "Release"],
    "edge.decide.model": ["Decision", "Model"],
    "edge.record.recording": ["Recording", "load"],
    "edge.record.saving": ["save"],
    "edge.wire.skin.skin": ["Skin"],
    "edge.touch.arm": ["Chain"],
    "edge.features.vector": ["feature_vector"],
    "edge.touch.region": ["find_regions", "largest_region"],
}
__all__ = sorted(name for names in _PUBLIC.values() for name in names)


def __getattr__(name: str) -> object:
    for module, names in _PUBLIC.items():
        if name in names:
            return getattr(import_module(module), name)
    raise AttributeError(f"module 'edge' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
