"""Forces that depend on speed: a Maxwell element and a dashpot beside a contact's
elastic law.

Beside the elastic force F a Maxwell element (Zener's) adds z with z' = -z / tau + r
dF/dt, and a dashpot adds T dF/dt. Let w = r F - z be the part of F already relaxed. A
step is the exact answer to a ramp of F within it, stable for any tau: with e = exp(-h /
tau) and s = r (1 - e) tau / h,

    z+ = e z + s (F+ - F),    w+ = e w + (s - e r) F + (r - s) F+,

so the contact bears (1 + s + T / h) F+ - L with L = e w + (s - e r + T / h) F. No term
of w or L is negative. So the law stays convex, its solvers still apply, no step can
make energy, and the length of a step affects only that step.

Where the forearm pivots, each row of the skin has its own element; elsewhere the first
row holds that of the whole contact. The effects `relaxation` and `inertia` share this
module.
"""

import numpy as np

from train.simulate.trials import Array, Group, PerRow, Trials


class Viscous(Group):
    """The Maxwell elements and dashpots.

    Attributes:
        loss_s, ratio, relax_s: (n,) T, r and tau.
        decay, let_go, late, damped: (n,) for the present step: e, r - s, s - e r and
            T / h.
        force, before: (rows, n) F and w.
    """

    loss_s: Array
    ratio: Array
    relax_s: Array
    decay: Array
    let_go: Array
    late: Array
    damped: Array
    force: PerRow
    before: PerRow


def stand(t: Trials) -> None:
    """Begin without any; the effects that share this module add theirs next."""
    t.add_state("viscous", Viscous, relax_s=1.0)


def tune(t: Trials) -> None:
    """Set the law for steps of this length."""
    viscous = t.states["viscous"]
    ratio = viscous.ratio
    damped = viscous.loss_s / t.clock.h
    part = t.clock.h / viscous.relax_s
    relaxes = ratio > 0.0
    decay = np.where(relaxes, np.exp(-part), 0.0)
    rise = np.where(relaxes, ratio * (-np.expm1(-part) / part), 0.0)
    viscous.damped = damped
    viscous.decay = decay
    viscous.let_go = ratio - rise
    viscous.late = rise - decay * ratio
    t.bed.gain = 1.0 + rise + damped
    bear_on(t)


def bear_on(t: Trials) -> None:
    """Set the load with which each row's next step begins."""
    viscous = t.states["viscous"]
    late = viscous.late + viscous.damped
    t.bed.load = -(viscous.decay * viscous.before + late * viscous.force)


def settle(t: Trials) -> None:
    """Update each row by the step's forces.

    Where no force is borne, the surface recovers by itself with gain F = -load.
    """
    viscous = t.states["viscous"]
    elastic = np.maximum((t.bed.row_force - t.bed.load) / t.bed.gain, 0.0)
    pushed = viscous.decay * viscous.before + viscous.late * viscous.force
    viscous.before = pushed + viscous.let_go * elastic
    viscous.force = elastic
    bear_on(t)
