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

from dataclasses import dataclass

import numpy as np

from train.simulate.trials import Array, Index, Trials, pick


@dataclass
class Viscous:
    """The Maxwell elements and dashpots.

    Attributes:
        loss_s, ratio, relax_s: (n,) T, r and tau.
        kept, let_go, late, damped, gain: (n,) for the present step: e, r - s, s - e r,
            T / h and 1 + s + T / h.
        force, given, load: (rows, n) F, w and -L.
    """

    loss_s: Array
    ratio: Array
    relax_s: Array
    kept: Array
    let_go: Array
    late: Array
    damped: Array
    gain: Array
    force: Array
    given: Array
    load: Array

    def set_step(self, i: Index, h: Array) -> None:
        """Set the terms for a step of this length."""
        ratio = pick(self.ratio, i)
        damped = pick(self.loss_s, i) / h
        part = h / pick(self.relax_s, i)
        relaxes = ratio > 0.0
        decay = np.where(relaxes, np.exp(-part), 0.0)
        rise = np.where(relaxes, ratio * (-np.expm1(-part) / part), 0.0)
        self.damped[i] = damped
        self.kept[i] = decay
        self.gain[i] = 1.0 + rise + damped
        self.let_go[i] = ratio - rise
        self.late[i] = rise - decay * ratio
        self.bear_on(i)

    def bear_on(self, i: Index) -> None:
        """Set the load with which each row's next step begins."""
        pushed = pick(self.given, i)
        force = pick(self.force, i)
        late = pick(self.late, i) + pick(self.damped, i)
        self.load[:, i] = -(pick(self.kept, i) * pushed + late * force)

    def move_on(self, i: Index, borne: Array) -> None:
        """Update the state by a step's forces (rows, n of i).

        Where no force is borne, the surface recovers by itself with gain F = L.
        """
        elastic = np.maximum((borne - pick(self.load, i)) / pick(self.gain, i), 0.0)
        pushed = pick(self.kept, i) * pick(self.given, i)
        pushed = pushed + pick(self.late, i) * pick(self.force, i)
        self.given[:, i] = pushed + pick(self.let_go, i) * elastic
        self.force[:, i] = elastic
        self.bear_on(i)


def begin(rows: int, n: int) -> Viscous:
    """The state of n trials without an element or a dashpot."""
    state = Viscous(*[*np.zeros((8, n)), *np.zeros((3, rows, n))])
    state.relax_s[:] = state.gain[:] = 1.0
    return state


def stand(t: Trials, i: Index) -> None:
    """Begin without any; the effects that share this module add theirs next."""
    t.states["viscous"] = begin(t.rows, t.n)


def tune(t: Trials, i: Index) -> None:
    """Set the law for steps of this length."""
    t.states["viscous"].set_step(i, pick(t.h, i))


def settle(t: Trials, i: Index) -> None:
    """Update each row by the step's forces."""
    upright = np.arange(t.n)[i][~t.plan.also("tilt", i)]
    t.row_force[0, upright] = pick(t.loads[0], upright)
    t.states["viscous"].move_on(i, pick(t.row_force, i))
