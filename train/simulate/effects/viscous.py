"""Forces that answer to speed: a Maxwell element and a dashpot beside a contact's elastic law.

Beside the elastic force F a Maxwell element (Zener's) adds z with z' = -z / tau + r dF/dt, and a
dashpot adds T dF/dt. Let w = r F - z be the part of F already relaxed. A step is the exact answer
to a ramp of F within it, stable for any tau: with e = exp(-h / tau) and s = r (1 - e) tau / h,

    z+ = e z + s (F+ - F),    w+ = e w + (s - e r) F + (r - s) F+,

so the contact bears (1 + s + T / h) F+ - L with L = e w + (s - e r + T / h) F. No term of w or L is
negative: the law stays convex, its solvers hold, no step can make energy, and nothing but the step
itself depends on its length.

Where the forearm pivots, each of the skin's rows has its own; elsewhere the first row's stands for
the whole contact. The effects `relaxation` and `inertia` build upon this one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from train.simulate.arm import Array
from train.simulate.plan import Index
from train.simulate.trials import Trials, pick


@dataclass
class Viscous:
    """What answers to speed.

    Attributes:
        loss_s, ratio, relax_s: (n,) T, r and tau.
        kept, let_go, late, damped, gain: (n,) of a step: e, r - s, s - e r, T / h, 1 + s + T / h.
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
        """What a step of this length comes to."""
        ratio = pick(self.ratio, i)
        damped, part = pick(self.loss_s, i) / h, h / pick(self.relax_s, i)
        relaxes = ratio > 0.0
        kept = np.where(relaxes, np.exp(-part), 0.0)
        rise = np.where(relaxes, ratio * (-np.expm1(-part) / part), 0.0)
        self.damped[i], self.kept[i], self.gain[i] = damped, kept, 1.0 + rise + damped
        self.let_go[i], self.late[i] = ratio - rise, rise - kept * ratio
        self.bear_on(i)

    def bear_on(self, i: Index) -> None:
        """The load that each row's next step begins with."""
        given, force = pick(self.given, i), pick(self.force, i)
        late = pick(self.late, i) + pick(self.damped, i)
        self.load[:, i] = -(pick(self.kept, i) * given + late * force)

    def move_on(self, i: Index, borne: Array) -> None:
        """What a step's forces (rows, n of i) leave behind for the next.

        Where nothing is borne the surface comes back by itself: there gain F = L.
        """
        elastic = np.maximum((borne - pick(self.load, i)) / pick(self.gain, i), 0.0)
        given = pick(self.kept, i) * pick(self.given, i)
        given = given + pick(self.late, i) * pick(self.force, i)
        self.given[:, i] = given + pick(self.let_go, i) * elastic
        self.force[:, i] = elastic
        self.bear_on(i)


def begin(rows: int, n: int) -> Viscous:
    """Neither an element nor a dashpot, of n trials."""
    own = Viscous(*[*np.zeros((8, n)), *np.zeros((3, rows, n))])
    own.relax_s[:] = own.gain[:] = 1.0
    return own


def stand(t: Trials, i: Index) -> None:
    """Begin without any; the effects that build upon it set theirs right after."""
    t.own["viscous"] = begin(t.rows, t.n)


def tune(t: Trials, i: Index) -> None:
    """The law in steps of this length."""
    t.own["viscous"].set_step(i, pick(t.h, i))


def settle(t: Trials, i: Index) -> None:
    """Each row moves on, under what the step has it bear."""
    upright = np.arange(t.n)[i][~t.plan.also("tilt", i)]
    t.row_force[0, upright] = pick(t.loads[0], upright)
    t.own["viscous"].move_on(i, pick(t.row_force, i))
