"""Forces that answer to speed: a Maxwell element and a dashpot beside a contact's elastic law.

Beside the elastic force F a Maxwell element (Zener's) adds z with z' = -z / tau + r dF/dt, and a
dashpot adds T dF/dt. Of F the element's own dashpot has let go of w = r F - z. A step is the exact
answer to a ramp of F within it, stable for any tau: with e = exp(-h / tau) and
s = r (1 - e) tau / h,

    z+ = e z + s (F+ - F),    w+ = e w + (s - e r) F + (r - s) F+,

so the whole is (1 + s + T / h) F+ - L with L = e w + (s - e r + T / h) F. No term of w or L is
negative: the law stays convex, its solvers hold, no step can make energy, and nothing but the step
itself depends on its length.

Where the forearm pivots, each of the skin's rows has its own; elsewhere one stands for the whole
contact.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit

from train.simulate import base
from train.simulate.compiled import call, integers, vector
from train.simulate.pivot_solver import PIVOT, pivot_of
from train.simulate.plan import Build
from train.simulate.state import State
from train.simulate.trial import Part, compiled

VISCOUS = Part(
    "viscous",
    # The elastic law's solver; how many lines; T; r and tau, or zeros.
    *integers("elastic", "lines"),
    *("loss_s", "ratio", "relax_s"),
    # Of a step: e, r - s, s - e r, T / h, and the whole's 1 + s + T / h.
    *("kept", "let_go", "late", "damped", "gain"),
    # Of each line: F, w, and -L.
    *integers("force", "given", "load"),
)
"""What answers to speed in a trial's contact."""
viscous_of = VISCOUS.of

RANK = base.ORDER + 30
"""In the setup, where the element and the dashpot begin; effects set theirs right after."""


def add(build: Build) -> None:
    """Let the contact answer to speed; the second effect that asks finds it done."""
    if VISCOUS in build.parts:
        return
    build.parts.add(VISCOUS)
    by_line = "tilt" in build.effects
    elastic = build.solve.address

    def begin(state: State) -> None:
        """No element yet, nor a dashpot, of the whole contact or of any row."""
        lines = state.skin.rows if by_line else 1
        none = np.zeros((lines, state.n))
        lent = {name: state.lend(f"viscous_{name}", none) for name in ("force", "given", "load")}
        state.begin(VISCOUS, elastic=elastic, lines=lines, **lent)

    build.put("setup", RANK, begin)
    if by_line:
        build.put("setup", RANK + 9, answer_to_speed)
        build.put("tune", RANK, tune_lines)
        build.put("step", base.SETTLE + 10, relax_lines)
    else:
        build.wrap(solve)
        build.put("tune", RANK, tune)
        build.put("step", base.SETTLE + 10, relax)


def answer_to_speed(state: State) -> None:
    """The pivot's solver asks each row for what answers to speed, too."""
    own = state.of(PIVOT)
    own.viscous, own.load = True, state.of(VISCOUS).load


@njit(error_model="numpy")
def in_steps(own: Any, h: float) -> None:
    """What a step of this length comes to."""
    own.damped, rise, own.kept = own.loss_s / h, 0.0, 0.0
    if own.ratio > 0.0:
        part = h / own.relax_s
        own.kept, rise = math.exp(-part), own.ratio * (-math.expm1(-part) / part)
    own.gain = 1.0 + rise + own.damped
    own.let_go, own.late = own.ratio - rise, rise - own.kept * own.ratio
    for line in range(own.lines):
        bear_on(own, line)


@njit(error_model="numpy")
def bear_on(own: Any, line: int) -> None:
    """What is there of a line's next load already."""
    force, given = vector(own.force, own.lines)[line], vector(own.given, own.lines)[line]
    load = vector(own.load, own.lines)
    load[line] = -(own.kept * given + (own.late + own.damped) * force)


@njit(error_model="numpy")
def move_on(own: Any, line: int, whole: float) -> None:
    """What a step's load on a line leaves behind for the next.

    Where nothing is borne the surface comes back by itself: there gain F = L.
    """
    force, given = vector(own.force, own.lines), vector(own.given, own.lines)
    elastic = max((whole - vector(own.load, own.lines)[line]) / own.gain, 0.0)
    given[line] = own.kept * given[line] + own.late * force[line] + own.let_go * elastic
    force[line] = elastic
    bear_on(own, line)


@compiled
def tune(t: Any) -> None:
    """The whole contact's law in steps of this length."""
    in_steps(viscous_of(t), t.h)


@compiled
def tune_lines(t: Any) -> None:
    """The rows' law in steps of this length."""
    own = viscous_of(t)
    in_steps(own, t.h)
    pivot_of(t).gain = own.gain


@compiled
def relax_lines(t: Any) -> None:
    """Each row moves on, under what the step's last answer has it bear; a row that the face does
    not cover bears nothing."""
    own, forces = viscous_of(t), vector(pivot_of(t).out, t.rows)
    for row in range(t.rows):
        move_on(own, row, forces[row])


@compiled
def relax(t: Any) -> None:
    """The whole contact moves on."""
    move_on(viscous_of(t), 0, t.loads[0])


@compiled
def solve(t: Any) -> None:
    """gain F - L: the elastic law with its compliance scaled, about a load that is there already.
    A contact never pulls: there it is 0."""
    own = viscous_of(t)
    load = vector(own.load, 1)[0]
    t.free[0] -= t.c[0] * load
    t.c[0] *= own.gain
    call(own.elastic, t.here)
    force = t.found[0]
    whole = own.gain * force + load
    t.found[0] = whole if force > 0.0 and whole > 0.0 else 0.0
