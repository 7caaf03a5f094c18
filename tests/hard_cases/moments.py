"""Second moments of a region, and the evidence that distances give for a label."""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction

import mpmath
import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from edge.model.stopping import margin
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from tests.hard_cases.cases import Case, Ladder, seeded
from tests.hard_cases.frames import FOREARM, FULL_SCALE, contact_of

MOMENTS = ("skin_length", "skin_width", "skin_spread_along", "skin_slant")
BAND = 12
"""Columns of the shapes: less than half of the cylinder, so that no seam cuts them."""


def shape(name: str, value: int, seed: int) -> NDArray[np.uint16]:
    """Counts near `value`; of "steep", taxels on a line that has no width."""
    rng = np.random.default_rng(seed)
    counts = np.zeros((16, 24), dtype=np.uint16)
    if name == "block":
        counts[:, :BAND] = value
    elif name == "line":
        counts[7, :BAND] = value
    elif name == "steep":
        steps = np.arange(4)
        counts[steps, 3 * steps] = rng.integers(max(value // 2, 60), value + 1, 4)
    else:
        counts[:, :BAND] = rng.integers(max(value // 2, 60), value + 1, (16, BAND))
    return counts


def moments(counts: NDArray[np.uint16]) -> list[mpmath.mpf]:
    """`MOMENTS` of a frame, from whole numbers and 50 digits."""
    places = [(int(counts[r, c]), int(r), int(c)) for r, c in np.argwhere(counts > 0)]
    force = sum(f for f, _, _ in places)
    row, col = (Fraction(sum(p[0] * p[i] for p in places), force) for i in (1, 2))
    along, around, slant = (
        sum(f * a(r, c) for f, r, c in places) / force
        for a in (
            lambda r, c: (r - row) ** 2,
            lambda r, c: (c - col) ** 2,
            lambda r, c: (r - row) * (c - col),
        )
    )
    with mpmath.workdps(50):
        xx, yy, xy = (mpmath.mpf(v.numerator) / v.denominator for v in (along, around, slant))
        split = mpmath.sqrt((xx - yy) ** 2 / 4 + xy**2)
        large, small = (xx + yy) / 2 + split, max((xx + yy) / 2 - split, mpmath.mpf(0))
        return [mpmath.sqrt(large), mpmath.sqrt(small), mpmath.sqrt(xx), xy]


def moment_error(name: str, value: int, seed: int) -> float:
    """Largest error of a moment, in the skin's larger side (its square for the slant)."""
    counts = shape(name, value, seed)
    contact = contact_of((Frame(0.01 * i, counts) for i in range(3)), features=MOMENTS)
    seen = feature_vector(contact.series(), 0.02, 3, MOMENTS).reshape(len(MOMENTS), 3)
    side = max(FOREARM.shape)
    worst = 0.0
    for row, truth, scale in zip(seen, moments(counts), (side, side, side, side**2), strict=True):
        worst = max(worst, *(abs(float(mpmath.mpf(float(x)) - truth)) / scale for x in row))
    return worst


def evidence_error(power: int, labels: int, seed: int) -> float:
    """How far `margin` is from the exact one, in parts of the larger root; sizes of 10^power."""
    stream = np.random.default_rng(seed)
    distances = (10.0**power * stream.uniform(0.5, 2.0, labels)).tolist()
    with localcontext(prec=60):
        roots = [Decimal(d).sqrt() for d in distances]
        worst = 0.0
        for label, own in enumerate(roots):
            other = min(root for i, root in enumerate(roots) if i != label)
            away = abs(Decimal(margin(distances, label)) - (other - own))
            worst = max(worst, float(away / max(own, other)))
    return worst


CASES = [
    Case(
        "features",
        "length, width, spread and slant of what touches, counts at full scale",
        "fractions, 50 digits",
        "parts of the skin's side",
        2.0**-25,
        moment_error,
        [
            {"name": name, "value": value, "seed": 0}
            for name in ("block", "line", "steep", "rough")
            for value in (60, 4095, 65535)
        ],
        {
            "name": st.sampled_from(["rough", "steep"]),
            "value": st.integers(60, 65535),
            "seed": st.integers(0, 999),
        },
        Ladder(
            "counts", [60, 4095, 16383, 65535], seeded("value", name="steep", seed=0), FULL_SCALE
        ),
    ),
    Case(
        "early stopping",
        "a label's margin from distances of any size",
        "60 digits",
        "parts of the larger distance",
        2.0**-51,
        evidence_error,
        [
            {"power": power, "labels": labels, "seed": 0}
            for power in (-150, -8, 0, 8, 150)
            for labels in (2, 36)
        ],
        {
            "power": st.integers(-150, 150),
            "labels": st.integers(2, 40),
            "seed": st.integers(0, 999),
        },
        Ladder(
            "decades of a squared distance", [0, 100, 200, 300], seeded("power", labels=36, seed=0)
        ),
    ),
]
