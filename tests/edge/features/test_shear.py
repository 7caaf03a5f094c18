"""Shear of a contact: whole numbers against plain loops, quantities against fractions,
and what turns with the skin."""

from dataclasses import replace
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.errors import InputError
from edge.features.quantities import OF_ZONES
from edge.features.vector import feature_vector
from edge.features.zones import SHEAR_WIDTH, ZONE_WIDTH, ZONES
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from tests.edge.touch.pressed import active_of, followed, quantities, zones_of

THRESHOLD = 10
LAYOUT = SkinLayout(
    5,
    7,
    threshold_counts=THRESHOLD,
    counts_per_newton=100.0,
    pitch_m=(0.01, 0.02),
    axes=3,
)
ALL = [
    f"{zone}_{quantity}"
    for zone in ZONES
    for quantity in OF_ZONES
    if "shear" in quantity
]
WIDTH = ZONE_WIDTH + SHEAR_WIDTH


def sheared_frame(seed, shape, high=32767, t=0.0) -> Frame:
    rng = np.random.default_rng(seed)
    counts = rng.integers(0, 65535, shape, endpoint=True) * (rng.random(shape) < 0.4)
    tangential = rng.integers(-high - 1, high, (*shape, 2), endpoint=True)
    valid = rng.random(shape) < 0.9
    return Frame(t, counts.astype(np.uint16), valid, shear=tangential.astype(np.int16))


def plain_sums(layout, frame, zone) -> list[int]:
    """The sums of a zone's shear over its taxels."""
    active = active_of(layout, frame)
    mask = active.largest().mask if zone == "contact" else active.mask
    half = layout.cols // 2
    sides = {"left": range(half), "right": range(half, layout.cols)}
    sums = np.zeros(2, dtype=int)
    for row, col in np.argwhere(mask).tolist():
        if col in sides.get(zone, range(layout.cols)):
            sums += frame.shear[row, col]
    return sums.tolist()


@settings(max_examples=60)
@given(
    seed=st.integers(0, 1 << 32),
    wraps=st.booleans(),
    shape=st.sampled_from([(5, 7), (1, 6), (6, 1)]),
)
def test_sums_are_those_of_plain_loops(seed, wraps, shape):
    layout = SkinLayout(*shape, wraps=wraps, threshold_counts=THRESHOLD, axes=3)
    frame = sheared_frame(seed, shape)
    if not active_of(layout, frame).bits:
        return
    zones = zones_of(layout, frame, ALL)
    for zone in ZONES:
        assert zones[zone][ZONE_WIDTH:] == plain_sums(layout, frame, zone)


@settings(max_examples=60)
@given(seed=st.integers(0, 1 << 32))
def test_quantities_are_those_of_fractions(seed):
    frame = sheared_frame(seed, LAYOUT.shape)
    if not active_of(LAYOUT, frame).bits:
        return
    row = zones_of(LAYOUT, frame, ALL)["skin"]
    force = row[2]
    along, around = row[ZONE_WIDTH:]
    values = quantities([row], LAYOUT, shear=True)
    assert values["shear_along"] == along / 100.0
    assert values["shear_around"] == around / 100.0
    size = Fraction(along) ** 2 + Fraction(around) ** 2
    assert values["shear_size"] == pytest.approx(float(size) ** 0.5 / 100.0, rel=1e-15)
    assert values["shear_ratio"] == pytest.approx(float(size) ** 0.5 / force, rel=1e-15)


def test_an_empty_zone_has_no_shear():
    values = quantities([[0] * WIDTH], LAYOUT, shear=True).values()
    assert not np.array([*values]).any()


@pytest.mark.parametrize("wraps", [False, True])
def test_the_largest_skin_full_of_the_largest_shear_does_not_overflow(wraps):
    side = 1024
    layout = SkinLayout(side, side, wraps=wraps, axes=3)
    tangential = np.full((side, side, 2), -32768, dtype=np.int16)
    frame = Frame(0.0, np.full((side, side), 65535, np.uint16), shear=tangential)
    row = zones_of(layout, frame, ["skin_shear_size"])["skin"]
    assert row[ZONE_WIDTH:] == [-32768 * side * side] * 2


def test_features_follow_the_shear_of_a_contact():
    frames = []
    for step in range(3):
        counts = np.zeros(LAYOUT.shape, dtype=np.uint16)
        counts[2, 3] = 200
        tangential = np.zeros((*LAYOUT.shape, 2), dtype=np.int16)
        tangential[2, 3] = 30 * step, 40 * step
        tangential[0, 0] = 1000  # beside the contact
        frames.append(Frame(0.5 * step, counts, shear=tangential))
    names = ["contact_shear_size", "contact_shear_ratio_rate", "skin_shear_around"]
    series = followed(LAYOUT, frames, features=names).series()
    vector = feature_vector(series, 1.0, 3, names)
    assert vector[:3] == pytest.approx([0.0, 0.5, 1.0], rel=1e-15)
    assert vector[3:6] == pytest.approx([0.5, 0.5, 0.5], rel=1e-15)
    assert vector[6:] == pytest.approx([0.0, 0.4, 0.8], rel=1e-15)


def test_the_shear_of_a_taxel_is_kept_apart_by_place_and_axis():
    frames = [sheared_frame(seed, LAYOUT.shape, t=0.5 * seed) for seed in range(3)]
    series = followed(LAYOUT, frames, features=["taxel_shear"]).series()
    vector = feature_vector(series, 1.0, 3, ["sqrt_taxel_shear"])
    known = [(f.shear * f.valid[..., None] / 100.0).reshape(-1, 2) for f in frames]
    expected = np.transpose(known, (2, 1, 0)).reshape(-1)
    assert (np.sign(vector) * vector**2).tolist() == pytest.approx(expected, rel=1e-15)


def test_a_frame_without_shear_is_named():
    frame = replace(sheared_frame(1, LAYOUT.shape), shear=None)
    with pytest.raises(InputError, match="need shear, which a frame lacks"):
        followed(LAYOUT, [frame], features=["taxel_shear"])
