"""What lies at the ends of the ranges: large skins, late clocks, ties made on purpose."""

from __future__ import annotations

import numpy as np
from hypothesis import strategies as st

from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.region import largest_region
from edge.touch.track import ContactTracker, TrackSettings
from tests.hard_cases.adversarial import FAMILIES, judged
from tests.hard_cases.cases import Case
from tests.hard_cases.frames import FOREARM

FAMILY_GROUP = "ties and gaps"
TOLD = 2.0**-48
"""Two candidates whose distances differ by more than this part of the rows' size are told apart:
a coordinate carries an error of at most 2^-52 of it, a sum of 20 squares and a root add a few."""


def skin_error(side: int, across: bool) -> float:
    """Error of area, peak and centroid of a block at full scale, over a quarter of the columns."""
    side = int(side)
    counts = np.zeros((side, side), np.uint16)
    width = side // 4
    first = -(width // 2) if across else width
    counts[:, np.arange(first, first + width) % side] = 65535
    region = largest_region(counts, 50, wraps=True)
    assert region is not None
    row, col = region.centroid
    gap = abs(col - (first + (width - 1) / 2)) % side
    errors = (region.area - side * width, region.peak - 65535, row - (side - 1) / 2)
    return max(*map(abs, errors), min(gap, side - gap))


def skin_usual() -> str:
    """float32 sums of counts times columns."""
    counts = np.full((256, 256), 65535, np.float32)
    columns = np.arange(256, dtype=np.float32)
    seen = (counts * columns).sum() / counts.sum()
    return f"float32 sums: the column is off by {abs(float(seen) - 127.5):.0e} on 256 x 256"


def clock_error(start: float) -> float:
    """Largest difference of a feature, in its own size, from that of a contact begun at 0.

    Steps of 2^-7 s from a whole number of seconds are exact to 2^45 s; beyond, frames are to be
    refused or their times kept, never merged without a word.
    """
    begin = float(np.floor(start))
    vectors = []
    for origin in (0.0, begin):
        tracker = ContactTracker(FOREARM, TrackSettings(debounce=1), horizon_s=1.2)
        contact = None
        for i in range(200):
            counts = np.zeros((16, 24), np.uint16)
            if i > 10:
                counts[4 : 6 + i // 50, 5:8] = 200 + 7 * i
            for seen in tracker.push(Frame(origin + i / 128.0, counts)):
                contact = contact or seen
        if contact is None:
            return float("inf")
        vectors.append(feature_vector(contact.series(), 1.2))
    scale = np.maximum(np.abs(vectors[0]), 1.0)
    return float((np.abs(vectors[1] - vectors[0]) / scale).max())


def clock_usual() -> str:
    """The same samples interpolated at float32 times."""
    t = np.float32(1.7e9) + np.arange(0, 1.2, 1 / 128, dtype=np.float32)
    return f"float32 times at 1.7e9 s: {len(np.unique(t))} of {len(t)} frames are told apart"


def family_error(family: str, seed: int, sets: int) -> float:
    """The largest difference of distances that was told wrongly without a flag."""
    return max(judged(family, seed + i).missed for i in range(sets))


CASES = [
    Case(
        "limits",
        "skins to 256 x 256 at full scale, across the seam",
        "whole numbers",
        "taxels, counts",
        0,
        skin_error,
        [{"side": side, "across": across} for side in (16, 64, 256) for across in (True, False)],
        {"side": st.integers(4, 64).map(lambda n: 4 * n), "across": st.booleans()},
        usual=skin_usual,
    ),
    Case(
        "limits",
        "contacts that begin late on the clock",
        "the same contact begun at 0",
        "of a feature",
        0,
        clock_error,
        [{"start": start} for start in (1.0, 1e5, 1.7e9)],
        {"start": st.floats(0.0, 9.2).map(lambda e: 10.0**e)},
        usual=clock_usual,
        examples=5,
    ),
    *(
        Case(
            FAMILY_GROUP,
            family.replace("_", " "),
            "whole numbers, no rounding",
            "difference of distances told wrongly, of the rows' size",
            TOLD,
            family_error,
            [{"family": family, "seed": 0, "sets": 8}],
            usual="does not apply: one engine's answer is its own judge; see `neighbours`",
        )
        for family in FAMILIES
    ),
]
