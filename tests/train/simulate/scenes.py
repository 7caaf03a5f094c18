"""Scenes of one object, for tests that hold the simulator against known answers."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from train.simulate.convergence import kinds
from train.simulate.engine import PhysicsRun, readings, run_physics
from train.simulate.readings import Readings
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


def specs_of(scene, step_s=0.01):
    """All trials of a scene, at a step."""
    every = (spec for specs in kinds(scene).values() for spec in specs)
    return tuple(replace(spec, step_s=step_s) for spec in every)


@dataclass(frozen=True)
class Batch(PhysicsRun):
    """A run with its readings, and their counts (n, frames, rows, cols)."""

    counts: np.ndarray
    seen: list[Readings]


def run_batch(scene, specs, **options) -> Batch:
    physics = run_physics(scene, specs, **options)
    seen = list(readings(physics))
    return Batch(**vars(physics), counts=np.stack([read.frames() for read in seen]), seen=seen)


def run(scene, step_s=0.01, **options) -> Batch:
    return run_batch(scene, specs_of(scene, step_s), **options)
