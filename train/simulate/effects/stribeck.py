"""Stribeck's law: friction falls from mu_s to mu_k as the object gathers speed,
mu(v) = mu_k + (mu_s - mu_k) exp(-(v / v_s)^2), taken at the speed before the step
(Armstrong-Helouvry, Dupont and Canudas de Wit, A survey of models for the control of
machines with friction, 1994)."""

import numpy as np

from train.simulate.trials import Trials


def drag(t: Trials) -> None:
    """Friction at the present speed."""
    mover = t.states["sliding"]
    kinetic = mover.kinetic
    part = mover.speed / t.values["stribeck_m_s"]
    now = kinetic + (mover.static - kinetic) * np.exp(-(part * part))
    mover.resist = now * mover.weight
