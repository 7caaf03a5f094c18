"""Features that go together, by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from edge.touch.feature_sets import contact, joints, moments, paper, taxels


@dataclass(frozen=True)
class FeatureSet:
    """A named set.

    Attributes:
        features: their names, see `edge.touch.measures`.
        price_us: what they add to following a contact, microseconds a frame of Cody's skin on
            one core of a workstation (`make bench`, `following`); a board takes longer, by much
            the same factor for all.
    """

    features: tuple[str, ...]
    price_us: float


SETS = {
    "paper": FeatureSet(paper.FEATURES, 33.0),
    "contact": FeatureSet(contact.FEATURES, 72.0),
    "moments": FeatureSet(moments.FEATURES, 45.0),
    "taxels": FeatureSet(taxels.FEATURES, 7.0),
    "sqrt_taxels": FeatureSet(taxels.SQRT, 7.0),
    "joints": FeatureSet(joints.FEATURES, 1.0),
    "posture": FeatureSet(joints.POSTURE, 1.0),
}


def expand(names: Sequence[str]) -> tuple[str, ...]:
    """The features of several sets, or single features, in their order, each once."""
    out: dict[str, None] = {}
    for name in names:
        out |= dict.fromkeys(SETS[name].features if name in SETS else (name,))
    return tuple(out)
