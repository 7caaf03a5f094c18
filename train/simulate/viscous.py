"""Forces that answer to speed: Maxwell elements beside the elastic law of a contact.

Beside the elastic force F_e each branch b adds z_b with z_b' = -z_b / tau_b + r_b dF_e/dt. A
step is the exact answer to a ramp of F_e within it, stable for any tau:
z+ = e z + s (F_e+ - F_e) with e = exp(-h / tau) and s = r (1 - e) tau / h, so that
F+ = (1 + sum s) F_e+ + Z with Z = sum(e z - s F_e). As F_e is never negative, neither is Z ever
positive: the law stays convex, its solvers hold, and no step can make energy.

Where the forearm pivots, each of the skin's rows has branches of its own; elsewhere one set
stands for the whole contact.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from train.simulate import base
from train.simulate.compiled import Array, call, integers, matrix, vector, vectors
from train.simulate.pivot_solver import PIVOT, pivot_of
from train.simulate.plan import Build
from train.simulate.state import Rows, State
from train.simulate.trial import Part, compiled

MOST = 2
"""Branches of a contact."""
BRANCHES = Part(
    "viscous",
    *integers("elastic", "count", "lines"),
    *vectors(MOST, "decay", "rise"),
    "gain",
    *integers("loads", "load"),
)
"""The branches of a trial: the elastic law's solver; how many there are, and of how many lines;
e and s of each; 1 + sum s; each branch's part of Z (MOST, lines), and Z (lines,)."""
branches_of = BRANCHES.of

RANK = base.ORDER + 30
"""In the setup, where the branches begin; effects let them `grow` right after."""


def add(build: Build) -> None:
    """Let the contact answer to speed; the second effect that asks finds it done."""
    if BRANCHES in build.parts:
        return
    build.parts.add(BRANCHES)
    by_line = "tilt" in build.effects
    elastic = build.solve.address

    def begin(state: State) -> None:
        """No branch yet, of the whole contact or of any row."""
        lines = state.skin.rows if by_line else 1
        none = np.zeros((lines, state.n))
        load = state.lend("branch", none)
        loads = state.lend("branches", np.zeros((MOST, *none.shape)))
        state.begin(BRANCHES, elastic=elastic, lines=lines, gain=1.0, loads=loads, load=load)

    build.put("setup", RANK, begin)
    if by_line:
        build.put("setup", RANK + 9, answer_to_speed)
        build.put("step", base.SETTLE + 10, relax_lines)
    else:
        build.wrap(solve)
        build.put("step", base.SETTLE + 10, relax)


def grow(branches: Rows, decay: Array, rise: Array) -> None:
    """One more branch, with e and s (n,)."""
    i = int(branches.count[0])
    branches.decay[:, i], branches.rise[:, i] = decay, rise
    branches.gain += rise
    branches.count += 1


@njit(error_model="numpy")
def move_on(own: Any, line: int, force: float) -> None:
    """What a step's force on a line leaves behind for the next.

    Where nothing is borne the surface comes back by itself: there (1 + sum s) F_e = -Z.
    """
    load, loads = vector(own.load, own.lines), matrix(own.loads, MOST, own.lines)
    elastic = max((force - load[line]) / own.gain, 0.0)
    load[line] = 0.0
    for b in range(own.count):
        decay = own.decay[b]
        loads[b, line] = decay * loads[b, line] - (1.0 - decay) * own.rise[b] * elastic
        load[line] += loads[b, line]


def answer_to_speed(state: State) -> None:
    """The rows bear what their branches do, too."""
    own, branches = state.of(PIVOT), state.of(BRANCHES)
    own.viscous, own.gain, own.load = True, branches.gain, branches.load


@compiled
def relax_lines(t: Any) -> None:
    """Each row's branches move on, under what the step's last answer has it bear; a row that the
    face does not cover bears nothing."""
    own, branches = pivot_of(t), branches_of(t)
    forces = vector(own.out, t.rows)
    for row in range(t.rows):
        move_on(branches, row, forces[row])


@compiled
def relax(t: Any) -> None:
    """The whole contact's branches move on."""
    move_on(branches_of(t), 0, t.loads[0])


@compiled
def solve(t: Any) -> None:
    """F = gain F_e + Z: the elastic law with its compliance scaled, about a load that is there
    already. A contact never pulls: there F = 0."""
    own = branches_of(t)
    load = vector(own.load, 1)[0]
    t.free[0] -= t.c[0] * load
    t.c[0] *= own.gain
    call(own.elastic, t.here)
    force = t.found[0]
    whole = own.gain * force + load
    t.found[0] = whole if force > 0.0 and whole > 0.0 else 0.0
