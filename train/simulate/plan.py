"""A plan: the flat tuples of functions that one kind of trial runs, and nothing else.

The effects called for are loaded by name and put their functions into the plan; an effect that
is not called for has no code loaded, no state, no random draws and no branch.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from train.simulate import base
from train.simulate.scene_model import Scene

Function = Callable[[Any], None]
STAGES = ("setup", "frame", "step", "sample", "clock", "sensor")
"""Once a batch; once a frame before its steps; each step; once a frame after its steps; once
on the frames' times; once on all frames."""


@dataclass(frozen=True)
class Plan:
    """What one kind of trial runs, in order."""

    effects: tuple[str, ...]
    setup: tuple[Function, ...]
    frame: tuple[Function, ...]
    step: tuple[Function, ...]
    sample: tuple[Function, ...]
    sensor: tuple[Function, ...]
    clock: tuple[Function, ...]
    solve: Callable[..., Any]
    owners: dict[Any, str]
    """{function: the effect it belongs to, or `base`}."""

    def __len__(self) -> int:
        """How many functions there are in all stages."""
        return sum(len(getattr(self, stage)) for stage in STAGES)


@dataclass
class Build:
    """A plan in the making; effects add to it in the catalogue's order."""

    scene: Scene
    effects: tuple[str, ...]
    entries: list[tuple[str, int, Function]] = field(default_factory=list)
    solve: Callable[..., Any] = base.solve
    owners: dict[Any, str] = field(default_factory=dict)
    owner: str = "base"
    around: Callable[[str, Callable[..., Any]], Callable[..., Any]] = lambda owner, f: f
    """What is put around each solver: nothing, or a clock."""

    def put(self, stage: str, rank: int, function: Function) -> None:
        """Add a function; within a stage the lower rank runs first."""
        self.entries.append((stage, rank, function))
        self.owners[function] = self.owner

    def replace(self, function: Function, by: Function) -> None:
        """Let `by` run where `function` would."""
        self.entries = [(s, r, by if f is function else f) for s, r, f in self.entries]
        self.owners[by] = self.owner

    def wrap(self, solve: Callable[..., Any]) -> None:
        """Let `solve` answer for the contact; it may ask the one before it."""
        self.solve = self.around(self.owner, solve)

    def settings(self, effect: str) -> dict[str, float]:
        """The effect's settings of the scene."""
        from train.simulate.schema import EFFECTS

        defaults = {k: float(f.default or 0.0) for k, f in EFFECTS[effect].settings.items()}
        return {**defaults, **self.scene.settings.get(effect, {})}


def make_plan(
    scene: Scene,
    effects: tuple[str, ...],
    around: Callable[[str, Callable[..., Any]], Callable[..., Any]] = lambda owner, f: f,
) -> Plan:
    """Flatten a scene's trials with these effects to a plan; `around` can time its solvers."""
    build = Build(scene, effects, around=around)
    build.wrap(base.solve)
    base.add(build)
    for name in effects:
        build.owner = name
        import_module(f"train.simulate.effects.{name}").add(build)
    stages = {
        stage: tuple(f for s, _, f in sorted(build.entries, key=lambda e: e[1]) if s == stage)
        for stage in STAGES
    }
    return Plan(effects=effects, solve=build.solve, owners=build.owners, **stages)
