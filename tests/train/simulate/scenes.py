"""Scenes of one object, for tests that hold the simulator against known answers."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from train.simulate.arm import Kinematics, pose_of
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


def poses(chain, q) -> SimpleNamespace:
    """The poses (..., n) of an arm at its angles (dof, n), as of `arm.pose_of`."""
    table, (dof, n) = Kinematics(chain).table, q.shape
    shapes = {"origin": (3,), "rotation": (3, 3), "axes": (3, dof), "origins": (3, dof)}
    found = {name: np.empty((n, *shape)) for name, shape in shapes.items()}
    for i in range(n):
        pose_of(table, np.ascontiguousarray(q[:, i]), *(part[i] for part in found.values()))
    return SimpleNamespace(**{name: np.moveaxis(part, 0, -1) for name, part in found.items()})
