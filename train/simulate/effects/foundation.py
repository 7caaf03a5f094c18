"""Elastic foundation: each taxel presses its own column of foam, of E A / H newtons a
metre.

On such independent columns a cylinder of radius R at depth d bears F/L = (4/3) (E/H) d
sqrt(2 R d) (Winkler's foundation; Johnson, Contact Mechanics, 4.3).
"""

from train.simulate.trials import Index, Trials, pick


def soften(t: Trials, i: Index) -> None:
    """Put a column of foam in series with each taxel."""
    area = t.skin.pitch[0] * t.skin.pitch[1]
    column = pick(t.values["modulus_pa"], i) * area / pick(t.values["depth_m"], i)
    t.taxel_k[i] = 1.0 / (1.0 / pick(t.taxel_k, i) + 1.0 / column)
