"""A plan: the flat tuples of functions that one kind of trial runs, and nothing else."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from train.simulate.readings import Readings
from train.simulate.scene_model import Scene
from train.simulate.schema import EFFECTS
from train.simulate.state import State
from train.simulate.trial import Part

SetupFunction = Callable[[State], None]
SensorFunction = Callable[[Readings], None]
Compiled = Any
"""A function of a trial, compiled (`trial.compiled`): it has an `address`."""
Trace = tuple[Part | None, str]
"""A field of an effect's own part of a trial, or of the trial itself."""

RUN_STAGES = ("pace", "tune", "frame", "step", "sample")
"""Compiled: what chooses a frame's steps; what depends on their length, whenever it changes; once a
frame before its steps; each step; once a frame after its steps."""
PHYSICS_STAGES = ("setup", *RUN_STAGES)
"""The setup runs once a batch."""
SENSOR_STAGES = ("clock", "sensor")
"""Once on the frames' times; once on all frames."""
STAGES = (*PHYSICS_STAGES, *SENSOR_STAGES)
PYTHON_STAGES = ("setup", *SENSOR_STAGES)


@dataclass(frozen=True)
class Plan:
    """What one kind of trial runs, in order."""

    effects: tuple[str, ...]
    setup: tuple[SetupFunction, ...]
    pace: tuple[Compiled, ...]
    tune: tuple[Compiled, ...]
    frame: tuple[Compiled, ...]
    step: tuple[Compiled, ...]
    sample: tuple[Compiled, ...]
    clock: tuple[SensorFunction, ...]
    sensor: tuple[SensorFunction, ...]
    solve: Compiled
    press: Compiled
    """The function of `step` that asks the solver."""
    traces: dict[str, Trace]
    """{name: where it stands}, kept for every frame."""
    owners: dict[Any, str]
    """{function: the effect it belongs to, or `base`}."""

    def addresses(self, stage: str) -> NDArray[np.int64]:
        """Of the functions of a compiled stage, in order."""
        return np.array([function.address for function in getattr(self, stage)], dtype=np.int64)

    def __len__(self) -> int:
        """How many functions there are in all stages."""
        return sum(len(getattr(self, stage)) for stage in STAGES)


@dataclass
class Build:
    """A plan in the making; effects add to it in the catalogue's order."""

    scene: Scene
    effects: tuple[str, ...]
    owner: str = "base"
    entries: list[tuple[str, int, Any]] = field(default_factory=list)
    solve: Compiled = field(init=False)
    press: Compiled = field(init=False)
    traces: dict[str, Trace] = field(default_factory=dict)
    owners: dict[Any, str] = field(default_factory=dict)
    parts: set[Part] = field(default_factory=set)
    """That several effects share, and one of them has put in."""

    def put(self, stage: str, rank: int, function: SetupFunction | Compiled) -> None:
        """Add a function to a stage of the physics; the lower rank runs first."""
        self.entries.append((stage, rank, function))
        self.owners[function] = self.owner

    def read(self, stage: str, rank: int, function: SensorFunction) -> None:
        """Add a function to a stage of the sensor; the lower rank runs first."""
        self.put(stage, rank, function)

    def replace(self, function: Any, by: Any) -> None:
        """Let `by` run where `function` would."""
        self.entries = [(s, r, by if f is function else f) for s, r, f in self.entries]
        self.owners[by] = self.owner
        if function is self.press:
            self.press = by

    def wrap(self, solve: Compiled) -> None:
        """Let `solve` answer for the contact; it may call the one before it."""
        self.solve = solve
        self.owners[solve] = self.owner

    def trace(self, name: str, part: Part | None, field: str) -> None:
        """Keep a field of every frame under this name: of an effect's part, or of the trial."""
        self.traces[name] = part, field

    def settings(self, effect: str) -> dict[str, float]:
        """The effect's settings of the scene."""
        defaults = {k: float(f.default or 0.0) for k, f in EFFECTS[effect].settings.items()}
        return {**defaults, **self.scene.settings.get(effect, {})}

    def plan(self) -> Plan:
        """The plan as it has been put together."""
        ranked = sorted(self.entries, key=lambda entry: entry[1])
        stages = {name: tuple(f for stage, _, f in ranked if stage == name) for name in STAGES}
        return Plan(
            effects=self.effects,
            **stages,
            solve=self.solve,
            press=self.press,
            traces=self.traces,
            owners=self.owners,
        )
