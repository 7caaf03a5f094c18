"""From the effects that a scene calls for to the plan that its trials run.

An effect is loaded by name and puts its functions into the plan; one that is not called for has
no code loaded, no state, no random draws and no branch.
"""

from __future__ import annotations

from importlib import import_module

from train.simulate import base
from train.simulate.plan import Build, Plan
from train.simulate.scene_model import Scene


def make_plan(scene: Scene, effects: tuple[str, ...]) -> Plan:
    """The plan of a scene's trials with these effects."""
    build = Build(scene, effects)
    base.add(build)
    for name in effects:
        build.owner = name
        import_module(f"train.simulate.effects.{name}").add(build)
    return build.plan()
