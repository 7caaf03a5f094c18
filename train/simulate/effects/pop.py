"""Bubble wrap: a bubble under each taxel stiffens by the gas law, and is gone once it
bursts.

Boyle's law p = p0 V0 / (V0 - A d) gives f = k0 d / (1 - d/b) for a bubble of height b. Three
tangents (at 0, b/2 and 3b/4) approximate it, each exactly in series with the skin's
spring. Between the points where they touch the law they lie below it: to a depth of
0.88 b by a third at most, where the first two cross, and by less in series with the
skin. Behind a burst bubble lies the hard backing, b deeper.
"""

import numpy as np

from train.simulate.contact import share_out, spring_loads, total
from train.simulate.effects import base
from train.simulate.trials import Trials

SLOPES = (1.0, 4.0, 16.0)
"""Slopes of the tangents, as multiples of k0."""
BREAKS = (1.0 / 3.0, 2.0 / 3.0)
"""Depths at which they cross, as multiples of b."""
SEGMENTS = len(SLOPES) + 1


def lay(t: Trials) -> None:
    """Lay four springs in each column: three tangents, and the backing for after the
    burst."""
    skin = t.bed.taxel_k
    k0 = t.values["bubble_n_m"]
    height = t.values["bubble_m"]
    slopes = [1.0 / (1.0 / skin + 1.0 / (k0 * s)) for s in SLOPES]
    first = k0 * height * BREAKS[0] / slopes[0]
    second = first + k0 * SLOPES[1] * height * (BREAKS[1] - BREAKS[0]) / slopes[1]
    gaps = t.bed.column_gaps
    steeper = (slopes[0], slopes[1] - slopes[0], slopes[2] - slopes[1], skin)
    intact = np.ones((SEGMENTS, len(gaps), len(t.bed.weight), len(t)))
    intact[-1] = 0.0
    base.lay_rows(t)
    t.add_springs(
        np.concatenate([gaps, gaps + first, gaps + second, gaps + height]),
        np.concatenate([t.bed.reach * k for k in steeper]),
        intact.reshape(-1, *intact.shape[2:]),
    )


def law(t: Trials) -> None:
    """The law of the springs that are left, for a forearm that does not pivot."""
    bed = t.bed
    gaps = bed.line_gap + bed.gaps[:, None]
    stiffness = bed.weight * (bed.stiffness[:, None] * bed.intact)
    t.set_bed_law(gaps.reshape(-1, len(t)), stiffness.reshape(-1, len(t)))


def image(t: Trials) -> None:
    """Share the force among the springs, then add up the four of each taxel."""
    bed = t.bed
    springs = slice(SEGMENTS * len(bed.columns))
    gaps = bed.gaps[springs]
    loads = spring_loads(t.touch.line_depth, gaps, bed.stiffness[springs], bed.weight)
    loads *= bed.intact[springs]
    share_out(t.touch.force, loads)
    by_segment = loads.reshape(SEGMENTS, -1, *loads.shape[1:])
    t.touch.image = total(by_segment).swapaxes(0, 1)


def pass_on(t: Trials) -> None:
    """Burst the overloaded bubbles, which leaves their backing from the next frame
    on."""
    burst = (t.touch.image > t.values["pop_n"]).swapaxes(0, 1)
    if not burst.any():
        return
    intact = t.bed.intact
    bubbles = intact[: SEGMENTS * len(burst)].reshape(SEGMENTS, *burst.shape)
    bubbles[:-1, burst] = 0.0
    bubbles[-1, burst] = 1.0
    t.bed.intact = intact
    t.only(np.any(burst, axis=(0, 1))).run("law")
