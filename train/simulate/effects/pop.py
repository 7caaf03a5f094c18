"""Bubble wrap: a bubble under each taxel stiffens by the gas law, and is gone once it
bursts.

Boyle's law p = p0 V0 / (V0 - A d) gives f = k0 d / (1 - d/b) for a bubble of height b. Three
tangents (at 0, b/2 and 3b/4) approximate it, each exactly in series with the skin's
spring. Between the points where they touch the law they lie below it: to a depth of
0.88 b by a third at most, where the first two cross, and by less in series with the
skin. Behind a burst bubble lies the hard backing, b deeper.
"""

from dataclasses import dataclass

import numpy as np

from train.simulate.contact import share_out, spring_loads
from train.simulate.effects import base
from train.simulate.trials import Array, Index, Places, Trials, pick, total

SLOPES = (1.0, 4.0, 16.0)
"""Slopes of the tangents, as multiples of k0."""
BREAKS = (1.0 / 3.0, 2.0 / 3.0)
"""Depths at which they cross, as multiples of b."""
SEGMENTS = len(SLOPES) + 1


@dataclass
class Bubbles:
    """Bubbles and the backing under each.

    Attributes:
        first: the place of their first spring in `Trials.gaps`; segments follow each
            other.
        gaps, stiffness: (S, n) of these springs.
        alive: (S, rows, n) 1 where a spring is left, 0 where it is gone.
    """

    first: int
    gaps: Array
    stiffness: Array
    alive: Array


def lay(t: Trials, i: Index) -> None:
    """Lay four springs in each column: three tangents, and the backing for after the
    burst."""
    values = {k: pick(v, i) for k, v in t.values.items()}
    skin = pick(t.taxel_k, i)
    k0 = values["bubble_n_m"]
    height = values["bubble_m"]
    slopes = [1.0 / (1.0 / skin + 1.0 / (k0 * s)) for s in SLOPES]
    first = k0 * height * BREAKS[0] / slopes[0]
    second = first + k0 * SLOPES[1] * height * (BREAKS[1] - BREAKS[0]) / slopes[1]
    gaps = pick(t.column_gaps, i)
    reach = pick(t.reach, i)
    gaps = np.concatenate([gaps, gaps + first, gaps + second, gaps + height])
    steeper = (slopes[0], slopes[1] - slopes[0], slopes[2] - slopes[1], skin)
    stiffness = np.concatenate([reach * k for k in steeper])
    base.lay_rows(t, i)
    state = t.states["pop"] = Bubbles(
        len(t.gaps),
        *[*np.zeros((2, len(gaps), t.n)), np.zeros((len(gaps), t.rows, t.n))],
    )
    state.gaps[:, i] = gaps
    state.stiffness[:, i] = stiffness
    state.alive[: -len(reach)] = 1.0
    t.add_springs(i, gaps, stiffness)


def law(t: Trials, i: Index) -> None:
    """The law of the springs that are left, for a forearm that does not pivot."""
    state = t.states["pop"]
    trials = np.arange(t.n)[i]
    alive = pick(state.alive, trials)
    weight = pick(t.weight, trials)
    gaps = pick(t.line_gap, trials) + pick(state.gaps, trials)[:, None]
    stiffness = weight * (pick(state.stiffness, trials)[:, None] * alive)
    t.obey(trials, gaps.reshape(-1, len(trials)), stiffness.reshape(-1, len(trials)))


def stand(t: Trials, i: Index) -> None:
    """Begin with no bubble burst."""
    change(t, np.arange(t.n)[i])


def change(t: Trials, trials: Places) -> None:
    """Give the solver the springs that are left."""
    state = t.states["pop"]
    tilted = t.plan.also("tilt", trials)
    if tilted.any():
        pivots = trials[tilted]
        t.states["tilt"].keep_alive(pivots, state.first, state.alive.take(pivots, -1))
    if not tilted.all():
        law(t, trials[~tilted])


def image(t: Trials, i: Index) -> None:
    """Share the force among the springs, then add up the four of each taxel."""
    state = t.states["pop"]
    loads = spring_loads(
        pick(t.line_depth, i),
        pick(state.gaps, i),
        pick(state.stiffness, i),
        pick(t.weight, i),
    )
    loads *= pick(state.alive, i)
    share_out(pick(t.force, i), loads)
    by_segment = loads.reshape(SEGMENTS, -1, *loads.shape[1:])
    t.image[:, :, i] = total(by_segment).swapaxes(0, 1)


def pass_on(t: Trials, i: Index) -> None:
    """Burst the overloaded bubbles, which leaves their backing from the next frame
    on."""
    state = t.states["pop"]
    burst = (pick(t.image, i) > pick(t.values["pop_n"], i)).swapaxes(0, 1)
    at = np.flatnonzero(burst.any(axis=(0, 1)))
    if not at.size:
        return
    trials = np.arange(t.n)[i][at]
    gone = burst.take(at, -1)
    alive = state.alive.take(trials, -1).reshape(SEGMENTS, *gone.shape)
    alive[:-1][:, gone] = 0.0
    alive[-1][gone] = 1.0
    state.alive[:, :, trials] = alive.reshape(-1, *gone.shape[1:])
    change(t, trials)
