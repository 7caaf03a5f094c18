"""`make matched`: the same four touches in MuJoCo and in our simulator.

The face is parallel to the forearm, rigid or soft, fixed or movable, with skin
friction. The table has means from 0.9 to 1.2 s after the touch, and the motion of the
thing by then. The pull along is that on the skin, from elbow to wrist. The shear around
is the sum of its sizes; ours has the part that the forearm's curve makes, and no
friction against a motion around the forearm. A movable thing lets the forearm swing on
by some 17 degrees in that time, until it lies askew over the face's end.
"""

import numpy as np

from tests.bench import mujoco_touch, tables
from tests.bench.mujoco_touch import LEAD_S, RATE_HZ, THRESHOLD_COUNTS, Thing, Touch
from tests.bench.program import start
from train.simulate.convergence import kinds
from train.simulate.engine import readings, run_physics
from train.simulate.scene import from_dict

UPRIGHT_DEG = (0.0, -4.0, 0.0, -3.9, 0.0)
"""With this start the forearm hangs straight as it touches, parallel to a standing
face."""
MIDDLE_M = 0.10332
PITCH_M = 0.0108
"""The middle of the skin's 16 rows, and the distance between two."""
BOX = Thing("box", floor=0.3, skin=0.4, height_m=0.3, below_m=0.15)
FOAM = Thing(
    "foam",
    floor=0.3,
    skin=0.4,
    height_m=14 * PITCH_M,
    breadth_m=0.15,
    modulus_pa=8e3,
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
    "total force, N": "10 %",
    "pull along, N": "20 %",
    "peak taxel, N": "20 %",
    "area, taxels": "20 %",
    "motion, mm": "10 %",
}
NOTHING = {"motion, mm": 1.0, "shear around, N": 0.2, "pull along, N": 0.7}
"""So little that a ratio says nothing."""
FROM_S = 0.9
TO_S = 1.2
STEP_S = 0.00125


def theirs(thing, fixed):
    """The quantities of the touch in MuJoCo."""
    touch = Touch(thing, fixed, tuple(np.radians(UPRIGHT_DEG)), place_m=MIDDLE_M)
    recording, force, moved_m = mujoco_touch.simulate(touch)
    return measured(recording.frames, recording.shear, force, moved_m)


def ours(thing, fixed):
    """The quantities of the touch in our simulator."""
    item = {
        "name": "thing",
        "family": "rigid",
        "conditions": ["fixed" if fixed else "movable"],
        "width_m": thing.height_m,
        "breadth_m": thing.breadth_m,
        "mass_kg": thing.mass_kg,
        "friction_static": thing.floor,
        "friction_kinetic": thing.floor,
        "skin_friction": thing.skin,
    }
    if thing.soft:
        item |= {"family": "foam", "relax_ratio": 0.6, "relax_s": 0.06}
        item |= {"modulus_pa": thing.modulus_pa, "depth_m": thing.thick_m}
    start_deg = np.add(mujoco_touch.START_DEG, UPRIGHT_DEG).tolist()
    scene = from_dict(
        {
            "trials": {"count": 1, "lead_s": LEAD_S, "after_s": mujoco_touch.TOUCH_S},
            "skin": {"axes": 3},
            "motion": {"start_deg": start_deg, "place_m": MIDDLE_M},
            "step_s": {"base": STEP_S},
            "effects": {"add": ["tilt", "inertia"]},
            "object": [item],
        }
    )
    batch = run_physics(scene, tuple(next(iter(kinds(scene).values()))))
    slide = batch.traces.get("slide_m", np.zeros_like(batch.force))
    reading = next(readings(batch))
    return measured(reading.frames(), reading.shear(), batch.force[0], slide[0])


def measured(frames, shear, force, moved_m):
    """The quantities of one engine, from counts (n, rows, cols), shear
    (n, rows, cols, 2), and newtons and metres moved (n,)."""
    onset = int(np.argmax(frames.max(axis=(1, 2)) > 60))
    window = slice(onset + round(FROM_S * RATE_HZ), onset + round(TO_S * RATE_HZ))
    counts = frames[window]
    pulls = shear[window].astype(float)
    areas = (counts > THRESHOLD_COUNTS).sum(axis=(1, 2))
    return {
        "total force, N": force[window].mean(),
        "pull along, N": pulls[..., 0].sum(axis=(1, 2)).mean() / 1e3,
        "shear around, N": np.abs(pulls[..., 1]).sum(axis=(1, 2)).mean() / 1e3,
        "peak taxel, N": counts.max(axis=(1, 2)).mean() / 1e3,
        "area, taxels": areas[areas > 0].mean(),
        "motion, mm": 1e3 * moved_m[window.stop],
    }


def measure():
    """Print the four touches, a row a quantity."""
    rows = []
    for name, touch in SCENES.items():
        mine = ours(*touch)
        for quantity, value in theirs(*touch).items():
            difference = "-"
            if abs(value) > NOTHING.get(quantity, 0.0):
                difference = f"{100 * (mine[quantity] / value - 1):+.0f} %"
            rows.append(
                {
                    "touch": name,
                    "quantity": quantity,
                    "MuJoCo": f"{value:.3g}",
                    "ours": f"{mine[quantity]:.3g}",
                    "difference": difference,
                    "allowed": ALLOWED.get(quantity, "-"),
                }
            )
    tables.write("matched", [rows])


if __name__ == "__main__":
    start(measure, __doc__)
