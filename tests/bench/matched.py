"""`make matched`: the same four touches in MuJoCo and in our simulator.

The face is parallel to the forearm, rigid or soft, fixed or movable, with skin
friction. The table has means from 0.9 to 1.2 s after the touch, and the motion of the
thing by then. A movable thing lets the forearm swing on by some 17 degrees in that
time, until it lies askew over the face's end.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tests.bench import mujoco_touch, tables
from tests.bench.mujoco_touch import LEAD_S, RATE_HZ, THRESHOLD_COUNTS, Thing, Touch
from train.simulate.convergence import kinds
from train.simulate.engine import readings, run_physics
from train.simulate.scene import from_dict

UPRIGHT_DEG = (0.0, -4.0, 0.0, -3.9, 0.0)
"""With this start the forearm hangs straight as it touches, parallel to a standing
face."""
MIDDLE_M, PITCH_M = 0.10332, 0.0108
"""The middle of the skin's 16 rows, and the distance between two."""
BOX = Thing("box", floor=0.3, skin=0.4, height_m=0.3, below_m=0.15)
FOAM = Thing(
    "foam", floor=0.3, skin=0.4, height_m=14 * PITCH_M, breadth_m=0.15, modulus_pa=8e3
)
"""The box is taller than the skin and the foam ends between two rows. On an end,
MuJoCo's pad is a ball and our taxel a square, which says nothing about physics."""
SCENES = {
    "rigid fixed": (BOX, True),
    "rigid movable": (BOX, False),
    "soft fixed": (FOAM, True),
    "soft movable": (FOAM, False),
}
ALLOWED = {
    "total force, N": 10,
    "peak taxel, N": 20,
    "area, taxels": 20,
    "motion, mm": 10,
}
FROM_S, TO_S = 0.9, 1.2
STEP_S = 0.00125


def theirs(thing: Thing, fixed: bool) -> tuple[NDArray, NDArray, NDArray]:
    """Frames, force and motion in MuJoCo."""
    touch = Touch(thing, fixed, tuple(np.radians(UPRIGHT_DEG)), place_m=MIDDLE_M)
    recording, force, moved_m = mujoco_touch.simulate(touch)
    return recording.frames, force, moved_m


def ours(thing: Thing, fixed: bool) -> tuple[NDArray, NDArray, NDArray]:
    """Frames, force and motion in our simulator."""
    condition = "fixed" if fixed else "movable"
    item = {"name": "thing", "family": "rigid", "conditions": [condition]}
    item |= {
        "width_m": thing.height_m,
        "breadth_m": thing.breadth_m,
        "mass_kg": thing.mass_kg,
    }
    item |= {"friction_static": thing.floor, "friction_kinetic": thing.floor}
    item |= {"skin_friction": thing.skin}
    if thing.soft:
        item |= {
            "family": "foam",
            "modulus_pa": thing.modulus_pa,
            "depth_m": thing.thick_m,
        }
        item |= {"relax_ratio": 0.6, "relax_s": 0.06}
    start = [a + b for a, b in zip(mujoco_touch.START_DEG, UPRIGHT_DEG, strict=True)]
    tables = {"trials": {"count": 1, "lead_s": LEAD_S, "after_s": mujoco_touch.TOUCH_S}}
    tables |= {
        "motion": {"start_deg": start, "place_m": MIDDLE_M},
        "step_s": {"base": STEP_S},
    }
    scene = from_dict(
        {**tables, "effects": {"add": ["tilt", "inertia"]}, "object": [item]}
    )
    batch = run_physics(scene, tuple(next(iter(kinds(scene).values()))))
    slide = batch.traces.get("slide_m", np.zeros_like(batch.force))
    return next(readings(batch)).frames(), batch.force[0], slide[0]


def measured(frames: NDArray, force: NDArray, moved: NDArray) -> dict[str, float]:
    """The four quantities of one engine."""
    onset = int(np.argmax(frames.max(axis=(1, 2)) > 60))
    window = slice(onset + round(FROM_S * RATE_HZ), onset + round(TO_S * RATE_HZ))
    counts = frames[window]
    touching = counts.max(axis=(1, 2)) > THRESHOLD_COUNTS
    return {
        "total force, N": float(force[window].mean()),
        "peak taxel, N": float(counts.max(axis=(1, 2)).mean() / 1e3),
        "area, taxels": float(
            (counts > THRESHOLD_COUNTS).sum(axis=(1, 2))[touching].mean()
        ),
        "motion, mm": 1e3 * float(moved[window.stop]),
    }


def main() -> None:
    """Print the four touches, a row a quantity."""
    rows = []
    for name, (thing, fixed) in SCENES.items():
        peer = measured(*theirs(thing, fixed))
        mine = measured(*ours(thing, fixed))
        for quantity, allowed in ALLOWED.items():
            still = quantity == "motion, mm" and peer[quantity] <= 1.0
            row = {"touch": name, "quantity": quantity}
            row["MuJoCo"] = f"{peer[quantity]:.3g}"
            row["ours"] = f"{mine[quantity]:.3g}"
            row["difference"] = "-"
            if not still:
                ratio = mine[quantity] / peer[quantity]
                row["difference"] = f"{100 * (ratio - 1):+.0f} %"
            row["allowed"] = f"{allowed} %"
            rows.append(row)
    tables.write("matched", [rows])


if __name__ == "__main__":
    main()
