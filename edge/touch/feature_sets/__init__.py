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
        price_us: what following a contact costs with them, microseconds a frame on the machine
            that `bench/README.md` names; the order of the sets by it holds elsewhere too.
    """

    features: tuple[str, ...]
    price_us: float


SETS = {
    "paper": FeatureSet(paper.FEATURES, 0.0),
    "contact": FeatureSet(contact.FEATURES, 0.0),
    "moments": FeatureSet(moments.FEATURES, 0.0),
    "taxels": FeatureSet(taxels.FEATURES, 0.0),
    "sqrt_taxels": FeatureSet(taxels.SQRT, 0.0),
    "joints": FeatureSet(joints.FEATURES, 0.0),
    "posture": FeatureSet(joints.POSTURE, 0.0),
}


def expand(names: Sequence[str]) -> tuple[str, ...]:
    """The features of several sets, or single features, in their order, each once."""
    out: dict[str, None] = {}
    for name in names:
        out |= dict.fromkeys(SETS[name].features if name in SETS else (name,))
    return tuple(out)
