"""No run makes energy: what the arm holds and has lost is judged against what was put in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from edge.errors import EdgeError
from train.simulate.base_steps import equilibrium
from train.simulate.compiled import Array
from train.simulate.state import State

ENERGY_MADE = 0.01
"""Share of the work put in that the arm may hold beyond it: what sampling at frames leaves open."""


def check_energy(state: State, joints: Array, t: Array) -> None:
    """Refuse a batch in which energy came out of nothing.

    The equilibrium point's motion is all that puts energy in, W = int k (q_eq - q) dq_eq, and the
    joints' damping takes at least d (dq)^2 / dt of it in each frame; so the arm's springs hold at
    most what is left, and what the arm brought as speed. What a contact has taken it may give back,
    but no more. A step that makes energy breaks the bound at once.

    Args:
        joints: (n, frames, dof) radians.
        t: (frames,) seconds.

    Raises:
        EdgeError: names the first trial that broke it.
    """
    scene = state.scene
    moving = 0.5 * sum(i * r * r for i, r in zip(scene.inertia, scene.rate, strict=False))
    i, k, held, work = first_made(state.records, joints, t, np.array(scene.damping), float(moving))
    if i >= 0:
        raise EdgeError(
            f"{scene.name}: trial {state.trials[i].number} of {state.trials[i].key} makes energy: "
            f"at {t[k]:g} s the arm holds or has lost {held:.3g} J, and {work:.3g} "
            "J have been put in; give [step_s] a smaller step, or the object less extreme values"
        )


@njit(cache=True, error_model="numpy")
def first_made(
    trials: NDArray[Any], joints: Array, times: Array, damping: Array, moving: float
) -> tuple[int, int, float, float]:
    """The first trial that makes energy and the frame in which it does; -1 where none does.

    Args:
        moving: joules that the arm brings as speed.

    Returns:
        Trial and frame, joules that the arm holds or has lost by then, and joules put in.
    """
    for i in range(len(trials)):
        t = trials[i]
        begun, work, to_and_fro, lost = 0.0, 0.0, 0.0, 0.0
        for k in range(len(times)):
            stored, put_in = 0.0, 0.0
            for j in range(t.joints):
                target = equilibrium(t, j, times[k])
                torque = t.joint_k[j] * (target - joints[i, k, j])
                stored += 0.5 * torque * (target - joints[i, k, j])
                if k > 0:
                    earlier = equilibrium(t, j, times[k - 1])
                    before = t.joint_k[j] * (earlier - joints[i, k - 1, j])
                    put_in += 0.5 * (torque + before) * (target - earlier)
                    turned = joints[i, k, j] - joints[i, k - 1, j]
                    lost += damping[j] * turned * turned / (times[k] - times[k - 1])
            if k == 0:
                begun = stored + moving
            work += put_in
            to_and_fro += abs(put_in)
            if not stored + lost <= begun + work + ENERGY_MADE * to_and_fro + 1e-9:
                return i, k, stored + lost, begun + work
    return -1, 0, 0.0, 0.0
