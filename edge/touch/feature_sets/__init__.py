"""Features that go together, by name."""

from __future__ import annotations

from collections.abc import Sequence

from edge.touch.feature_sets import contact, joints, moments, paper, taxels

SETS: dict[str, tuple[str, ...]] = {
    "paper": paper.FEATURES,
    "contact": contact.FEATURES,
    "moments": moments.FEATURES,
    "taxels": taxels.FEATURES,
    "sqrt_taxels": taxels.SQRT,
    "joints": joints.FEATURES,
    "posture": joints.POSTURE,
}
"""{set: names of its features, see `edge.touch.measures`}."""


def expand(names: Sequence[str]) -> tuple[str, ...]:
    """The features of several sets, or single features, in their order, each once."""
    out: dict[str, None] = {}
    for name in names:
        out |= dict.fromkeys(SETS.get(name, (name,)))
    return tuple(out)
