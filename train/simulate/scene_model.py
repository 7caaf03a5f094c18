"""What a scene consists of, checked: its objects, and all that its trials share."""

from __future__ import annotations

from dataclasses import dataclass, field

from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout
from train.simulate.reader import Value


@dataclass(frozen=True)
class SceneObject:
    """A thing that the arm meets."""

    name: str
    family: str
    conditions: tuple[str, ...]
    values: dict[str, Value]
    given: frozenset[str]
    """Keys that the file gives; the others are the family's."""

    @property
    def slug(self) -> str:
        """The name, fit for a file."""
        return "-".join("".join(c if c.isalnum() else " " for c in self.name.lower()).split())


@dataclass(frozen=True)
class Scene:
    """All that a simulation needs; `load` reads it from TOML."""

    name: str
    seed: int
    trials: dict[str, float]
    step_s: dict[str, float]
    """{effect, or `base`: the largest step that its trials may take}; empty: to be measured."""
    lead: Value
    arm: Chain
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    start: tuple[float, ...]
    """(dof,) radians, the equilibrium point at t = 0."""
    rate: tuple[float, ...]
    """(dof,) rad/s."""
    travel_s: float
    """How long the equilibrium point moves."""
    skin: SkinLayout
    taxel_n_m: Value
    place_m: float
    """z in the skin's link of the point that meets the object."""
    spread: dict[str, float]
    objects: tuple[SceneObject, ...]
    add: tuple[str, ...]
    leave_out: tuple[str, ...]
    settings: dict[str, dict[str, float]] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Trials of each object in each condition."""
        return int(self.trials["count"])
