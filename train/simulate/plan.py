"""A plan: the flat tuples of functions that one kind of trial runs, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from train.simulate.contact import Array
from train.simulate.scene_model import Scene
from train.simulate.schema import EFFECTS
from train.simulate.state import Readings, Solver, State

PhysicsFunction = Callable[[State], None]
SensorFunction = Callable[[Readings], None]
Around = Callable[[str, Callable[..., Any]], Callable[..., Any]]
"""(owner, function) -> the function with something put around it: nothing, or a stopwatch."""

PHYSICS_STAGES = ("setup", "frame", "step", "sample")
"""Once a batch; once a frame before its steps; each step; once a frame after its steps."""
SENSOR_STAGES = ("clock", "sensor")
"""Once on the frames' times; once on all frames."""
STAGES = (*PHYSICS_STAGES, *SENSOR_STAGES)


@dataclass(frozen=True)
class Plan:
    """What one kind of trial runs, in order."""

    effects: tuple[str, ...]
    setup: tuple[PhysicsFunction, ...]
    frame: tuple[PhysicsFunction, ...]
    step: tuple[PhysicsFunction, ...]
    sample: tuple[PhysicsFunction, ...]
    clock: tuple[SensorFunction, ...]
    sensor: tuple[SensorFunction, ...]
    solve: Solver
    traces: dict[str, Callable[[State], Array]]
    """{name: what it is in a state (n,)}, kept for every frame."""
    owners: dict[Any, str]
    """{function: the effect it belongs to, or `base`}."""
    taped: bool = True
    """Frames are run by tape (`recorder`), not function by function."""

    def __len__(self) -> int:
        """How many functions there are in all stages."""
        return sum(len(getattr(self, stage)) for stage in STAGES)


@dataclass
class Build:
    """A plan in the making; effects add to it in the catalogue's order."""

    scene: Scene
    effects: tuple[str, ...]
    around: Around = lambda owner, function: function
    owner: str = "base"
    entries: list[tuple[str, int, PhysicsFunction]] = field(default_factory=list)
    sensors: list[tuple[str, int, SensorFunction]] = field(default_factory=list)
    solve: Solver = field(init=False)
    traces: dict[str, Callable[[State], Array]] = field(default_factory=dict)
    owners: dict[Any, str] = field(default_factory=dict)

    def put(self, stage: str, rank: int, function: PhysicsFunction) -> None:
        """Add a function to a stage of the physics; the lower rank runs first."""
        self.entries.append((stage, rank, function))
        self.owners[function] = self.owner

    def read(self, stage: str, rank: int, function: SensorFunction) -> None:
        """Add a function to a stage of the sensor; the lower rank runs first."""
        self.sensors.append((stage, rank, function))
        self.owners[function] = self.owner

    def replace(self, function: PhysicsFunction, by: PhysicsFunction) -> None:
        """Let `by` run where `function` would."""
        self.entries = [(s, r, by if f is function else f) for s, r, f in self.entries]
        self.owners[by] = self.owner

    def wrap(self, solve: Solver) -> None:
        """Let `solve` answer for the contact; it may ask the one before it."""
        self.solve = self.around(self.owner, solve)

    def trace(self, name: str, quantity: Callable[[State], Array]) -> None:
        """Keep a quantity (n,) of every frame under this name."""
        self.traces[name] = quantity

    def settings(self, effect: str) -> dict[str, float]:
        """The effect's settings of the scene."""
        defaults = {k: float(f.default or 0.0) for k, f in EFFECTS[effect].settings.items()}
        return {**defaults, **self.scene.settings.get(effect, {})}

    def plan(self) -> Plan:
        """The plan as it has been put together."""

        def stage(name: str) -> tuple[PhysicsFunction, ...]:
            ranked = sorted((e for e in self.entries if e[0] == name), key=lambda e: e[1])
            return tuple(function for _, _, function in ranked)

        def reading(name: str) -> tuple[SensorFunction, ...]:
            ranked = sorted((e for e in self.sensors if e[0] == name), key=lambda e: e[1])
            return tuple(function for _, _, function in ranked)

        return Plan(
            effects=self.effects,
            setup=stage("setup"),
            frame=stage("frame"),
            step=stage("step"),
            sample=stage("sample"),
            clock=reading("clock"),
            sensor=reading("sensor"),
            solve=self.solve,
            traces=self.traces,
            owners=self.owners,
        )
