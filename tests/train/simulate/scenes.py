"""Scenes of one object, for tests that hold the simulator against known answers."""

from __future__ import annotations

from train.simulate.engine import Batch, run_batch
from train.simulate.run import kinds
from train.simulate.scene import Scene, from_dict


def one_object(**keys):
    thing = {"name": "thing", "family": "rigid", "conditions": ["fixed"], **keys}
    return [thing]


def make(objects, *add, **trials) -> Scene:
    return from_dict(
        {
            "trials": {"count": 2, **trials},
            "step_s": {"base": 1.0 / trials.get("rate_hz", 100)},
            "effects": {"add": list(add)},
            "object": objects,
        }
    )


def run(scene, step_s=0.01) -> Batch:
    return run_batch(scene, tuple(next(iter(kinds(scene).values()))), step_s)
