"""Standard linear solid: a second spring, k1 = ratio * k, in series with a dashpot that
relaxes it (`viscous`; Zener, Elasticity and anelasticity of metals, 1948). One time
constant stands for the many of a real foam."""

from train.simulate.trials import Trials


def stand(t: Trials) -> None:
    """Make the second spring and its dashpot the contact's Maxwell element."""
    viscous = t.states["viscous"]
    viscous.ratio = t.values["relax_ratio"]
    viscous.relax_s = t.values["relax_s"]
