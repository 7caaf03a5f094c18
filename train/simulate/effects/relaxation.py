"""Standard linear solid: beside the spring a second one, k1 = ratio * k, that a dashpot empties
within its time (`viscous`)."""

from __future__ import annotations

from train.simulate.plan import Index
from train.simulate.trials import Trials, pick


def stand(t: Trials, i: Index) -> None:
    """The second spring and its dashpot are the contact's Maxwell element."""
    viscous = t.own["viscous"]
    viscous.ratio[i] = pick(t.values["relax_ratio"], i)
    viscous.relax_s[i] = pick(t.values["relax_s"], i)
