"""The simulator's guards."""

from __future__ import annotations

from tests.mutation.guard import Guard

TILT = "train/simulate/pivot_solver.py"
ENERGY = "train/simulate/simulate_energy.py"
"""Has no such module: its tests are asked about every effect."""

SIMULATOR = (
    Guard(
        "the tilt's Newton steps are cut back",
        f"{TILT}:search",
        "size *= min(max(begin / (begin - end), 0.1), 0.9)",
        "pass",
        "tilt",
    ),
    Guard(
        "the tilt's loads come from the side with more digits",
        f"{TILT}:agree",
        "force = (at.c11 * d0 - at.c01 * d1) / det",
        "force = found[0]",
        "tilt",
    ),
    Guard(
        "what answers to speed only takes",
        "train/simulate/viscous.py:move_on",
        "own.kept * given[line] + own.late * force[line] + own.let_go * elastic",
        "own.kept * given[line] - own.late * force[line] - own.let_go * elastic",
        beside=ENERGY,
    ),
    Guard(
        "the arm is as fast as it moved",
        "train/simulate/effects/inertia.py:move",
        "own.speed[j] = (t.q[j] - own.before[j]) / t.h",
        "own.speed[j] = 1.02 * (t.q[j] - own.before[j]) / t.h",
        beside=ENERGY,
    ),
    Guard(
        "friction's pull is against the slip, on the arm",
        "train/simulate/effects/friction.py:hold",
        "t.q_free[j] -= t.give[j] * own.jacobian[j] * own.pull",
        "t.q_free[j] += t.give[j] * own.jacobian[j] * own.pull",
        beside=ENERGY,
    ),
    Guard(
        "friction holds no more than the load lets it",
        "train/simulate/effects/friction.py:hold",
        "own.pull = min(max(stuck, least), most)",
        "own.pull = stuck",
        beside=ENERGY,
    ),
    Guard(
        "the skin's shear cannot lift more than a thing weighs",
        "train/simulate/effects/friction.py:weigh",
        "mover_of(t).weight = max(own.weight - own.pull * t.along_face[2], 0.0)",
        "mover_of(t).weight = own.weight - own.pull * t.along_face[2]",
        beside=ENERGY,
    ),
    Guard(
        "what slides has the mass of its step",
        "train/simulate/motion.py:give_way",
        "mover.speed + t.h / mover.inertia * (t.found[0] - drag)",
        "mover.speed + 1.1 * t.h / mover.inertia * (t.found[0] - drag)",
        beside=ENERGY,
    ),
    Guard(
        "a lean stores what it gives back",
        "train/simulate/effects/tipping.py:topple",
        "own.force * (1.0 - mover.slide / own.travel)",
        "own.force * (1.0 - 2.0 * mover.slide / own.travel)",
        beside=ENERGY,
    ),
    Guard(
        "a stem's damping is about where it is",
        "train/simulate/effects/stems.py:bend",
        "intercepts[s] = held_intercepts[s] + drag * t.depth[0]",
        "intercepts[s] = held_intercepts[s] - drag * t.depth[0]",
        beside=ENERGY,
    ),
    Guard(
        "what was compiled with older sources is not found",
        "train/simulate/compiled.py:record",
        'np.dtype((np.record, [*named, (f"of_{SOURCES}", "i8")]))',
        "np.dtype((np.record, named))",
    ),
    Guard(
        "an arm of more joints than a record has room for is refused",
        "train/simulate/arm.py:__init__",
        "if chain.dof > JOINTS: ...",
        "if False: ...",
    ),
    Guard(
        "an object inside the arm is refused",
        "train/simulate/engine.py:check_start",
        "if held.any(): ...",
        "if False: ...",
    ),
    Guard(
        "energy out of nothing is refused",
        "train/simulate/energy.py:check_energy",
        "if i >= 0: ...",
        "if False: ...",
        beside=ENERGY,
    ),
)
