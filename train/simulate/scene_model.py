"""A checked scene: its objects, the values that its trials share, and the table it is
read from."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from edge.config import ConfigTable
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout
from train.simulate.arm import Array, Kinematics
from train.simulate.schema import EFFECTS, RATE_DEG_S, Field


@dataclass(frozen=True)
class Value:
    """A number of a scene, either fixed or drawn uniformly between two limits."""

    low: float
    high: float


class SceneTable(ConfigTable):
    """A table of a scene, which checks numbers against the schema."""

    def field(self, key: str, field: Field, default: float | None = None) -> float:
        """The number of a field; `default` replaces the field's own."""
        value = field.default if default is None else default
        if field.integer:
            allowed = range(int(field.low), int(field.high) + 1)
            return float(self.whole(key, value, allowed))
        return self.number(key, value, field.low, field.high, open_low=field.open_low)

    def fields(self, fields: Mapping[str, Field]) -> dict[str, float]:
        """The numbers of a table that may have no other keys."""
        out = {key: self.field(key, field) for key, field in fields.items()}
        self.refuse_unknown()
        return out

    def value(self, key: str, field: Field, default: object = None) -> Value:
        """A field's number, or its range [low, high]."""
        value = self.get(key, field.default if default is None else default)
        ends = value if isinstance(value, list) else [value, value]
        if len(ends) != 2:
            raise self.fail(key, "one number or a range [low, high]")
        low, high = (
            self.number(
                key,
                0,
                field.low,
                field.high,
                open_low=field.open_low,
                value=end,
            )
            for end in ends
        )
        if low > high:
            raise self.fail(
                key, f"a range with its lower limit first, [{high:g}, {low:g}]"
            )
        return Value(low, high)

    def names(
        self,
        key: str,
        allowed: tuple[str, ...],
        default: object = (),
    ) -> tuple[str, ...]:
        """A list of different names, each of which is allowed."""
        names = self.texts(key, default)
        if not set(names) <= set(allowed) or len(set(names)) != len(names):
            raise self.fail(
                key, f"a list of different names out of {', '.join(allowed)}"
            )
        return names


@dataclass(frozen=True)
class SceneObject:
    """An object that the arm meets."""

    name: str
    family: str
    conditions: tuple[str, ...]
    values: dict[str, Value]
    file_keys: frozenset[str]
    """Keys that the file gives; the other values are the family's defaults."""

    @cached_property
    def slug(self) -> str:
        """The name in a form that suits a file name."""
        return "-".join(
            "".join(c if c.isalnum() else " " for c in self.name.lower()).split()
        )


@dataclass(frozen=True)
class Cylinder(SkinLayout):
    """A skin around a forearm, whose geometry and scale are known."""

    radius_m: float = 1.0
    column_angles_deg: tuple[float, ...] = ()
    counts_per_newton: float = 1.0

    @cached_property
    def row_z(self) -> Array:
        """(rows, 1) metres of each row in the skin's link."""
        return self.row0_z_m - self.pitch[0] * np.arange(float(self.rows))[:, None]


@dataclass(frozen=True)
class TrialSpec:
    """A trial to simulate: an object, its condition, and a number that seeds it."""

    object: SceneObject
    condition: str
    number: int
    step_s: float = 0.01
    """Length of a physics step; a frame has a whole number of them."""
    attempt: int = 0
    """Number of earlier draws of this trial, which contradicted its label."""

    @property
    def key(self) -> str:
        """The name of the object and its condition in streams and files."""
        return f"{self.object.slug}-{self.condition}"


@dataclass(frozen=True)
class Scene:
    """Everything that a simulation needs; `scene.load` reads it from TOML."""

    name: str
    seed: int
    trials: dict[str, float]
    step_s: dict[str, float]
    """{effect, or `base`: the longest step of its trials}."""
    lead: Value
    arm: Chain
    stiffness: tuple[float, ...]
    damping: tuple[float, ...]
    inertia: tuple[float, ...]
    """(dof,) kg m^2 of each joint."""
    start: tuple[float, ...]
    """(dof,) radians of the equilibrium point at t = 0."""
    rate: tuple[float, ...]
    """(dof,) rad/s of the equilibrium point."""
    travel_s: float
    """Seconds for which the equilibrium point moves."""
    skin: Cylinder
    taxel_n_m: Value
    place_m: float
    """z in the skin's link of the point that meets the object."""
    spread: dict[str, float]
    labels: dict[str, float]
    """When and by how much an object must do as its label says."""
    objects: tuple[SceneObject, ...]
    add: tuple[str, ...]
    settings: dict[str, dict[str, float]] = field(default_factory=dict)

    @cached_property
    def kinematics(self) -> Kinematics:
        """The arm's kinematics."""
        return Kinematics(self.arm)

    @property
    def kinds(self) -> list[tuple[SceneObject, str]]:
        """Each object in each of its conditions."""
        return [(item, c) for item in self.objects for c in item.conditions]

    @property
    def values(self) -> dict[str, Value]:
        """{name: value} of trials with any object."""
        values = {"lead_s": self.lead, "taxel_n_m": self.taxel_n_m}
        if self.spread.get("travel_s"):
            values["travel_s"] = Value(self.travel_s, self.travel_s)
        values |= {key: Value(0.0, 0.0) for key in self.spread if RATE_DEG_S in key}
        return values

    @property
    def rate_hz(self) -> float:
        """Frames a second."""
        return self.trials["rate_hz"]

    @property
    def count(self) -> int:
        """Number of trials of each object in each condition."""
        return int(self.trials["count"])

    @property
    def frame_count(self) -> int:
        """Number of frames of a trial: the longest lead, the time after it, and the
        frame at t = 0."""
        return round((self.lead.high + self.trials["after_s"]) * self.rate_hz) + 1

    @property
    def recording_bytes(self) -> int:
        """Bytes of a trial's times, joint angles and counts."""
        axes = self.skin.axes or 1
        return self.frame_count * (
            8 + 8 * self.arm.dof + 2 * axes * math.prod(self.skin.shape)
        )

    def setting(self, effect: str, key: str) -> float:
        """A setting of an effect, or its default."""
        return self.settings.get(effect, {}).get(
            key, EFFECTS[effect].settings[key].default or 0.0
        )
