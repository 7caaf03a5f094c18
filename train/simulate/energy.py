"""Checks that no trial gains energy: what the arm stores and loses against the work put in."""

from __future__ import annotations

import numpy as np

from edge.errors import EdgeError
from train.simulate.arm import Array
from train.simulate.trials import Trials

ENERGY_MADE = 0.01
"""Tolerance as a part of the work put in, since frames only sample that work."""


def check_energy(t: Trials, joints: Array, times: Array) -> None:
    """Check that no trial gains energy.

    Only the motion of the equilibrium point puts energy in, W = int k (q_eq - q) dq_eq. The joints'
    damping takes at least d (dq)^2 / dt of it in each frame. So the arm's springs store at most the
    rest, plus the energy of the arm's motion at the start. A contact may give back what it has
    taken, but no more. A step that makes energy breaks this bound at once.

    Args:
        joints: (n, frames, dof) radians.
        times: (frames,) seconds.

    Raises:
        EdgeError: a trial gains energy; the sentence names the first one.
    """
    scene, k = t.scene, t.joint_k.T
    moving = 0.5 * sum(i * r * r for i, r in zip(scene.inertia, scene.rate, strict=False))
    targets = t.start.T[:, None] + t.rate.T * np.minimum(times[:, None], t.travel_s.T[:, None])
    torque = k * (targets - joints)
    stored = (0.5 * torque * (targets - joints)).sum(axis=2)
    put_in = (0.5 * (torque[:, 1:] + torque[:, :-1]) * np.diff(targets, axis=1)).sum(axis=2)
    turned = t.damping.T * np.diff(joints, axis=1) ** 2 / np.diff(times)[:, None]
    work, both_ways, lost = (
        np.pad(np.add.accumulate(part, axis=1), ((0, 0), (1, 0)))
        for part in (put_in, np.abs(put_in), turned.sum(axis=2))
    )
    held, brought = stored + lost, stored[:, :1] + moving + work
    made = ~(held <= brought + ENERGY_MADE * both_ways + 1e-9)
    if made.any():
        i = int(np.argmax(made.any(axis=1)))
        frame = int(np.argmax(made[i]))
        raise EdgeError(
            f"{scene.name}: trial {t.specs[i].number} of {t.specs[i].key} makes energy: "
            f"at {times[frame]:g} s the arm has stored or lost {held[i, frame]:.3g} J of the "
            f"{brought[i, frame]:.3g} J put in; give [step_s] a smaller step, or the "
            "object less extreme values"
        )
