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

from dataclasses import dataclass

import numpy as np

from train.simulate import base
from train.simulate.contact import Array, Coordinates, Springs, relieve
from train.simulate.plan import Build
from train.simulate.state import Bed, State


@dataclass
class Branches:
    """The branches of a batch.

    Attributes:
        decay, rise: (n,) e and s of each branch.
        loads: each branch's part of Z: (n,), or (rows, n) where the forearm pivots.
        gain: (n,) 1 + sum s.
        load: Z, the sum of `loads`.
    """

    decay: list[Array]
    rise: list[Array]
    loads: list[Array]
    gain: Array
    load: Array

    def grow(self, decay: Array, rise: Array) -> None:
        """One more branch."""
        self.decay.append(decay)
        self.rise.append(rise)
        self.loads.append(np.zeros_like(self.load))
        self.gain = self.gain + rise

    def move_on(self, force: Array) -> None:
        """What a step's force leaves behind for the next.

        Where nothing is borne the surface comes back by itself: there (1 + sum s) F_e = -Z.
        """
        elastic = np.maximum((force - self.load) / self.gain, 0.0)
        self.loads = [
            decay * load - (1.0 - decay) * rise * elastic
            for decay, rise, load in zip(self.decay, self.rise, self.loads, strict=True)
        ]
        self.load = sum(self.loads[1:], self.loads[0])


class ViscousBed(Bed):
    """A bed whose lines have branches of their own."""

    gain: Array
    load: Array

    def lines_of(self, springs: Springs, lever: Array) -> Springs:
        """The bed's springs, with what answers to speed."""
        lines = super().lines_of(springs, lever)
        return lines._replace(gain=self.gain, load=self.load)


RANK = base.ORDER + 30
"""In the setup, where the branches begin; effects let them `grow` right after."""


def add(build: Build) -> None:
    """Let the contact answer to speed; the second effect that asks finds it done."""
    if any(function in (begin, begin_lines) for _, _, function in build.entries):
        return
    if "tilt" in build.effects:
        from train.simulate.effects.tilt import line_forces

        def relax_lines(state: State) -> None:
            """Each row's branches move on; a row that the face does not cover bears nothing."""
            own, bed = state.of(Branches), state.bed
            assert isinstance(bed, ViscousBed)
            own.move_on(line_forces(state))
            bed.load = own.load

        build.put("setup", RANK, begin_lines)
        build.put("setup", RANK + 9, give_lines)
        build.put("step", base.SETTLE + 10, relax_lines)
        return
    elastic = build.solve

    def viscous(state: State, y: Coordinates, c: Coordinates) -> Coordinates:
        """F = gain F_e + Z: the elastic law with its compliance scaled, about a load that is
        there already. A contact never pulls: there F = 0."""
        own = state.of(Branches)
        (force,) = elastic(state, relieve(y, c, (own.load,)), (own.gain * c[0],))
        whole = own.gain * force + own.load
        return (np.where((force > 0.0) & (whole > 0.0), whole, 0.0),)

    build.wrap(viscous)
    build.put("setup", RANK, begin)
    build.put("step", base.SETTLE + 10, relax)


def begin(state: State) -> None:
    """No branch yet."""
    state.keep(Branches([], [], [], np.ones(state.n), np.zeros(state.n)))


def relax(state: State) -> None:
    """The whole contact's branches move on."""
    state.of(Branches).move_on(state.loads[0])


def begin_lines(state: State) -> None:
    """No branch yet, in any row."""
    state.keep(Branches([], [], [], np.ones(state.n), np.zeros((state.skin.rows, state.n))))


def give_lines(state: State) -> None:
    """The bed, whatever its springs are, with branches in each line."""
    own, bed = state.of(Branches), state.bed
    kind = type(f"Viscous{type(bed).__name__}", (ViscousBed, type(bed)), {})
    viscous: ViscousBed = object.__new__(kind)
    viscous.__dict__.update(vars(bed), gain=own.gain, load=own.load)
    state.bed = viscous
