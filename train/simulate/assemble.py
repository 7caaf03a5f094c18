"""From the effects that a scene calls for to the plan that its trials run.

An effect is loaded by name and puts its functions into the plan; one that is not called for has
no code loaded, no state, no random draws and no branch.
"""

from __future__ import annotations

from importlib import import_module

from train.simulate import base
from train.simulate.plan import Around, Build, Plan
from train.simulate.scene_model import Scene


def make_plan(
    scene: Scene,
    effects: tuple[str, ...],
    around: Around = lambda owner, function: function,
) -> Plan:
    """The plan of a scene's trials with these effects; `around` can time its solvers."""
    build = Build(scene, effects, around)
    base.add(build)
    for name in effects:
        build.owner = name
        import_module(f"train.simulate.effects.{name}").add(build)
    return build.plan()
