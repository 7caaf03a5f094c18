"""`make matched`: the same four touches in MuJoCo and in our simulator, beside theory.

The face is parallel to the forearm, rigid or soft, fixed or movable, with skin friction. The table
has means from 0.9 to 1.2 s after the touch, and the motion of the thing by then. Theory is
quasi-static. A fixed face bears the arm's stiffness times its advance; a sliding one bears mu m g.
A soft face's contact is as wide as on an elastic layer under that load, and its pressure is a half
ellipse. A movable thing lets the forearm swing on by some 17 degrees in that time. Its force is
still the friction, less what slows the arm, but the forearm now lies askew over the face's end,
where theory gives no peak and no area.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from bench import mujoco_touch
from bench.mujoco_touch import LEAD_S, RADIUS_M, RATE_HZ, THRESHOLD_COUNTS, Thing, Touch
from train.simulate.convergence import kinds
from train.simulate.effects.lateral import SPREAD
from train.simulate.engine import readings, run_physics
from train.simulate.scene import from_dict

UPRIGHT_DEG = (0.0, -4.0, 0.0, -3.9, 0.0)
"""With this start the forearm hangs straight as it touches, parallel to a standing face."""
MIDDLE_M, PITCH_M, ROUND_M = 0.10332, 0.0108, 0.01205
"""The middle of the skin's 16 rows; distances of taxels along and around the forearm."""
BOX = Thing("box", floor=0.3, skin=0.4, height_m=0.3, below_m=0.15)
FOAM = Thing("foam", floor=0.3, skin=0.4, height_m=14 * PITCH_M, breadth_m=0.15, modulus_pa=8e3)
"""The box is taller than the skin and the foam ends between two rows. On an end, MuJoCo's pad is a
ball and our taxel a square, which says nothing about physics."""
SCENES = {
    "rigid fixed": (BOX, True),
    "rigid movable": (BOX, False),
    "soft fixed": (FOAM, True),
    "soft movable": (FOAM, False),
}
ALLOWED = {"total force, N": 10, "peak taxel, N": 20, "area, taxels": 20, "motion, mm": 10}
FROM_S, TO_S = 0.9, 1.2
ARM_N_M, SPEED_M_S = 115.0, 0.15
STEP_S = 0.00125


def theirs(thing: Thing, fixed: bool) -> tuple[NDArray, NDArray, NDArray]:
    """Frames, force and motion in MuJoCo."""
    touched = mujoco_touch.simulate(
        Touch(thing, fixed, tuple(np.radians(UPRIGHT_DEG)), place_m=MIDDLE_M)
    )
    return touched.recording.frames, touched.force, touched.moved_m


def ours(thing: Thing, fixed: bool) -> tuple[NDArray, NDArray, NDArray]:
    """Frames, force and motion in our simulator."""
    item = {"name": "thing", "family": "foam" if thing.soft else "rigid"}
    item |= {"conditions": ["fixed" if fixed else "movable"]}
    item |= {"width_m": thing.height_m, "breadth_m": thing.breadth_m, "mass_kg": thing.mass_kg}
    item |= {"friction_static": thing.floor, "friction_kinetic": thing.floor}
    item |= {"skin_friction": thing.skin}
    if thing.soft:
        item |= {"modulus_pa": thing.modulus_pa, "depth_m": thing.thick_m}
        item |= {"relax_ratio": 0.6, "relax_s": 0.06}
    start = [a + b for a, b in zip(mujoco_touch.START_DEG, UPRIGHT_DEG, strict=True)]
    scene = from_dict(
        {
            "trials": {"count": 1, "lead_s": LEAD_S, "after_s": 1.8},
            "motion": {"start_deg": start, "place_m": MIDDLE_M},
            "effects": {"add": ["tilt", "inertia"]},
            "step_s": {"base": STEP_S},
            "object": [item],
        }
    )
    batch = run_physics(scene, tuple(next(iter(kinds(scene).values()))))
    slide = batch.traces.get("slide_m", np.zeros_like(batch.force))
    return next(readings(batch)).frames(), batch.force[0], slide[0]


def theory(thing: Thing, fixed: bool) -> dict[str, float]:
    """The quasi-static values; NaN where theory has no simple answer."""
    middle = 0.5 * (FROM_S + TO_S)
    hold = math.inf if fixed else thing.floor * thing.mass_kg * 9.81
    out = dict.fromkeys(ALLOWED, math.nan)
    if not thing.soft:
        force = min(ARM_N_M * SPEED_M_S * middle, hold)
        out["total force, N"] = force
        out["motion, mm"] = 0.0 if fixed else 1e3 * (SPEED_M_S * TO_S - hold / ARM_N_M)
        return out
    modulus, depth, length = thing.modulus_pa, thing.thick_m, thing.height_m

    def load(a: float) -> float:
        return length * modulus / RADIUS_M * (2 / 3 * a**3 / depth + SPREAD * a**2)

    def pressed(a: float) -> float:
        inside = a * a / 2 + 0.36 * depth * (a - 0.19 * depth * math.log1p(a / (0.19 * depth)))
        return inside / RADIUS_M

    def excess(a: float) -> float:
        return load(a) / ARM_N_M + pressed(a) - SPEED_M_S * middle if fixed else load(a) - hold

    a = float(brentq(excess, 1e-6, 0.2))
    force = load(a)
    out["total force, N"] = force
    out["motion, mm"] = 0.0 if fixed else 1e3 * (SPEED_M_S * TO_S - hold / ARM_N_M - pressed(a))
    if not fixed:
        return out
    out["peak taxel, N"] = 4.0 * force / (math.pi * 2 * a * length) * PITCH_M * ROUND_M
    out["area, taxels"] = 2 * a / ROUND_M * length / PITCH_M
    return out


def measured(frames: NDArray, force: NDArray, moved: NDArray) -> dict[str, float]:
    """The four quantities of one engine."""
    onset = int(np.argmax(frames.max(axis=(1, 2)) > 60))
    part = slice(onset + round(FROM_S * RATE_HZ), onset + round(TO_S * RATE_HZ))
    touching = frames[part].max(axis=(1, 2)) > THRESHOLD_COUNTS
    return {
        "total force, N": float(force[part].mean()),
        "peak taxel, N": float(frames[part].max(axis=(1, 2)).mean() / 1e3),
        "area, taxels": float((frames[part] > THRESHOLD_COUNTS).sum(axis=(1, 2))[touching].mean()),
        "motion, mm": 1e3 * float(moved[part.stop]),
    }


def main() -> None:
    """Print the four touches, a line a quantity."""
    print(f"{'':16}{'':16}{'MuJoCo':>9}{'ours':>9}{'off':>7}{'allowed':>9}{'theory':>9}")
    for name, (thing, fixed) in SCENES.items():
        mujoco, own = measured(*theirs(thing, fixed)), measured(*ours(thing, fixed))
        right = theory(thing, fixed)
        for quantity, allowed in ALLOWED.items():
            a, b = mujoco[quantity], own[quantity]
            off = f"{100 * (b / a - 1):+.0f} %" if a > 1.0 or quantity != "motion, mm" else "-"
            law = "-" if math.isnan(right[quantity]) else f"{right[quantity]:.3g}"
            print(f"{name:16}{quantity:16}{a:>9.3g}{b:>9.3g}{off:>7}{allowed:>7} %{law:>9}")
            name = ""


if __name__ == "__main__":
    main()
