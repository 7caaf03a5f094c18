"""The whole numbers of zones against sums in plain Python."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.features.zones import SHEAR_WIDTH, ZONE_WIDTH, ZONES
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.edge.touch.pressed import active_of, quantities, zones_of

FLAT = SkinLayout(5, 7, threshold_counts=10, counts_per_newton=100.0)


def frame_of(seed: int, shape, density=0.4, high=65535) -> Frame:
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, high, shape, endpoint=True) * (rng.random(shape) < density)
    shear = rng.integers(-32768, 32767, (*shape, 2), endpoint=True)
    valid = rng.random(shape) < 0.9
    return Frame(0.0, counts.astype("u2"), valid=valid, shear=shear.astype("i2"))


def plain_sums(frame: Frame, mask, turn: int) -> list[int]:
    """The numbers of a zone, by plain sums; the best of all cuts of a turn."""
    rows, cols = mask.nonzero()
    forces = frame.counts[mask].astype(int)
    candidates = []
    for cut in range(turn or 1):
        c = np.where(cols < cut, cols + turn, cols)
        weights = (1, rows, c, rows**2, rows * c, c**2)
        sums = [int((forces * weight).sum()) for weight in weights]
        variance = sums[0] * sums[5] - sums[2] ** 2
        candidates.append((variance, cut, sums))
    largest = int(forces.max(initial=0))
    return [largest, len(forces), *min(candidates)[2], *frame.shear[mask].sum(0, int)]


def expected(layout: SkinLayout, frame: Frame) -> dict[str, list[int]]:
    active = active_of(layout, frame)
    contact = active.largest()
    if contact is None:
        return dict.fromkeys(ZONES, [0] * (ZONE_WIDTH + SHEAR_WIDTH))
    left = np.arange(layout.cols) < layout.cols // 2
    turn = layout.cols * layout.wraps
    return {
        "contact": plain_sums(frame, contact.mask, turn),
        "skin": plain_sums(frame, active.mask, turn),
        "left": plain_sums(frame, active.mask & left, 0),
        "right": plain_sums(frame, active.mask & ~left, 0),
    }


@settings(max_examples=80)
@given(
    seed=st.integers(0, 1 << 32),
    density=st.sampled_from([0.05, 0.6, 1.0]),
    high=st.sampled_from([12, 65535]),
    wraps=st.booleans(),
    shape=st.sampled_from([(5, 7), (1, 6), (6, 1)]),
    has_shear=st.booleans(),
)
def test_whole_numbers_of_every_zone_are_those_of_plain_sums(
    seed, density, high, wraps, shape, has_shear
):
    layout = SkinLayout(*shape, wraps=wraps, threshold_counts=10)
    frame = frame_of(seed, shape, density, high)
    of_zone = "shear_size" if has_shear else "force"
    zones = zones_of(layout, frame, [f"{zone}_{of_zone}" for zone in ZONES])
    width = ZONE_WIDTH + SHEAR_WIDTH * has_shear
    plain = {zone: row[:width] for zone, row in expected(layout, frame).items()}
    assert zones == plain


@pytest.mark.parametrize("wraps", [False, True])
def test_the_largest_skin_full_of_the_largest_numbers_does_not_overflow(wraps):
    side = 1024
    layout = SkinLayout(side, side, wraps=wraps)
    frame = Frame(0.0, np.full((side, side), 65535, "u2"))
    frame = replace(frame, shear=np.full((side, side, 2), -32768, "i2"))
    line = sum(range(side))
    row = side * line
    squares = side * sum(c * c for c in range(side))
    sums = (side * side, row, row, squares, line * line, squares)
    numbers = zones_of(layout, frame, ["skin_shear_size"])["skin"]
    assert numbers[2:ZONE_WIDTH] == [65535 * v for v in sums]
    assert numbers[ZONE_WIDTH:] == [-32768 * side * side] * 2
    values = quantities([numbers], layout)
    spread = np.sqrt((side**2 - 1) / 12)
    assert values["spread_along"] == pytest.approx(spread, rel=1e-15)
    assert values["slant"] == 0.0
