"""From bytes to trusted values: which taxels are valid, and which chips are doubted."""

import math
from dataclasses import replace

import numpy as np
import pytest

from edge.wire.chips import block, mpr121
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses, fake_skin, still
from edge.wire.skin.decoder import (
    HELD_S,
    NEVER_STUCK,
    SCALE_BITS,
    Baseline,
    repeat_chance,
    stuck_limits,
)
from edge.wire.skin.file import Reading, Signal, TaxelCalibration
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import Skin
from edge.wire.skin.wiring import BusSpec
from tests.edge.wire.skin.small import CHIP, CODY, FIRST, PICTURE


def served(taxels, **options):
    """A microcontroller that serves these taxels."""
    return replace(
        CODY.chips[0],
        kind=block.Block,
        address=0x28,
        mux=None,
        channel=None,
        options=options,
        taxels=tuple(taxels),
    )


def test_chips_of_different_kinds_make_one_skin():
    ad, mpr, *replaced = CODY.chips
    mpr = replace(mpr, kind=mpr121.MPR121, address=0x5B)
    mcu = served(taxel for chip in replaced for taxel in chip.taxels)
    file = replace(CODY, buses=(BusSpec("a", (ad, mpr)), BusSpec("b", (mcu,))))
    picture = PICTURE % 400
    with fake_skin(file, lambda t: picture) as skin:
        np.testing.assert_array_equal(skin.read().counts, picture)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("raw", "valid"), [(1, True), (52_946, True), (52_947, False), (0xFFFF, False)]
)
def test_a_value_that_no_touch_reaches_is_not_valid_and_its_chip_is_checked(
    sign,
    raw,
    valid,
):
    """Rest 20946, saturation 30000 counts and 2000 of drift: the wire's ones are
    beyond."""
    signal = replace(CODY.signal, saturation_counts=30_000)
    bus = replace(FIRST, chips=(replace(CODY.chips[0], sign=sign),))
    reading = Reading(recheck_frames=100)
    with still(replace(CODY, buses=(bus,), signal=signal, reading=reading)) as skin:
        [reader] = skin.readers
        [slot], before = reader.slots, reader.bus.transactions

        def spoiled(row=slot.row, read=slot.chip.read):
            read()
            row[8:10] = divmod(raw, 256)

        slot.chip.read = spoiled
        frame = skin.read()
        skin.read()
        # Two frames read the chip and its mux once each; every further transaction is a
        # check.
        checks = reader.bus.transactions - before - 2 * 2
    assert frame.valid[1, 1] == valid
    assert frame.valid.sum() == 11 + valid
    assert checks == (not valid)


def test_dead_and_uncovered_taxels_are_never_valid():
    signal = replace(CODY.signal, dead=((1, 1), (2, 3)))
    with fake_skin(replace(CHIP, signal=signal), lambda t: PICTURE) as skin:
        frame = skin.read()
    expected = np.zeros((16, 24), dtype=bool)
    expected[:4, :3] = True
    expected[1, 1] = False
    np.testing.assert_array_equal(frame.valid, expected)
    assert (frame.counts[~expected] == 0).all()
    assert np.isfinite(frame.times).all()


def test_a_chip_whose_bytes_never_change_is_stuck_where_it_made_noise_before():
    file = calibrated(CHIP, noise_counts=4.0)
    draw = np.random.default_rng(1)
    with fake_skin(file, lambda t: draw.integers(0, 14, (16, 24), np.uint16)) as skin:
        valid = [
            frame.valid[:4, :3].all() for frame in Loop(skin, lasts_s=1.5).frames()
        ]
    assert valid == [True] * 150
    with fake_skin(file, lambda t: np.zeros((16, 24), np.uint16)) as skin:
        valid = [bool(skin.read().valid[:4, :3].all()) for _ in range(150)]
    # The twelve taxels repeat with a chance of 3e-14.
    assert valid.index(False) == 2


@pytest.mark.parametrize(
    ("noise", "limit"),
    [(4.0, 2), (0.5, 8), (0.3, 20), (0.2, 44), (0.1, 100), (0.05, NEVER_STUCK)],
)
def test_equal_readings_prove_a_frozen_chip_only_where_noise_shows_in_counts(
    noise, limit
):
    """At a noise of 0.5 counts a taxel repeats with the chance 0.59: the twelve of an
    AD7147 do so four times in a row with less than 1e-9, and two frames may hold one
    conversion."""
    assert (stuck_limits(calibrated(CODY, noise)) == limit).all()


def test_the_chance_of_an_equal_reading_is_the_sum_of_squared_chances():
    """Of a normal distribution, or of one count up and down where noise is small."""
    edges = (np.arange(-40, 42) - 0.5) / (4.0 * 2**0.5)
    shares = np.diff([math.erf(edge) for edge in edges]) / 2.0
    assert repeat_chance(np.array(4.0)) == pytest.approx(np.square(shares).sum(), 0.005)
    side = 0.2**2 / 2.0
    exact = (1.0 - 2.0 * side) ** 2 + 2.0 * side**2
    assert repeat_chance(np.array(0.2)) == pytest.approx(exact)


@pytest.mark.parametrize(
    ("rest", "valid"), [(1000, False), (7999, False), (8000, True)]
)
def test_a_value_further_below_its_baseline_than_any_touch_is_not_valid(rest, valid):
    """By 40000 counts of the file's `saturation_counts` and 2000 of drift."""

    def resting_at(counts):
        calibration = TaxelCalibration(np.full((16, 24), counts), np.zeros((16, 24)))
        return replace(CHIP, calibration=calibration)

    clock = VirtualClock()
    buses = fake_buses(resting_at(rest), lambda t: np.zeros((16, 24), np.uint16), clock)
    with Skin(resting_at(50_000), buses, clock=clock) as skin:
        skin.start()
        assert skin.read().valid.sum() == 12 * valid


EVERY = np.ones(3, dtype=bool)


def baseline(rest, noise=0.0, sign=1, step_counts=0.0, limit=0):
    """A baseline whose dead band is the noise, and that follows by so many counts."""
    return Baseline(Signal(1.0, 0, step_counts, limit), 1.0, rest, noise, sign)


def raw(*values):
    return np.array(values, dtype=np.uint16)


def test_counts_are_above_the_baseline_by_sign():
    rising = baseline([1000] * 3)
    falling = baseline([1000] * 3, sign=-1)
    assert rising.above(raw(1500, 1000, 400)).tolist() == [500, 0, 0]
    assert falling.above(raw(1500, 1000, 400)).tolist() == [0, 0, 600]


def test_counts_in_the_dead_band_are_zero():
    band = baseline([1000] * 3, noise=[20, 1, 0])
    assert band.above(raw(1019, 1001, 1000)).tolist() == [0, 1, 0]
    assert band.above(raw(1020, 1000, 999)).tolist() == [20, 0, 0]


def test_the_whole_range_fits():
    assert baseline([0]).above(raw(65535)).tolist() == [65535]
    assert baseline([65535], sign=-1).above(raw(0)).tolist() == [65535]


def test_it_follows_valid_taxels_by_no_more_than_its_rate_up_to_its_limit():
    followed = baseline([1000] * 4, step_counts=0.25, limit=50)
    valid = np.array([True, True, True, False])
    for frames, expected in (
        (100, [1025, 975, 1010, 1000]),
        (1000, [1050, 950, 1010, 1000]),
    ):
        for _ in range(frames):
            followed.follow(raw(3000, 0, 1010, 1200), valid)
        assert followed.counts.tolist() == expected


def test_half_a_count_is_rounded_up():
    """A step of 1/8 count: Python's whole numbers are the oracle."""
    following = baseline([1000] * 3, step_counts=0.125, limit=500)
    for step in range(1, 17):
        following.follow(raw(3000, 0, 1000), EVERY)
        eighths = (8000 + step, 8000 - step, 8000)
        assert following.counts.tolist() == [(n + 4) // 8 for n in eighths]


def test_it_follows_a_quarter_of_the_error_rounded_to_the_nearest():
    """Python's whole numbers are the oracle, of 1/4096 count."""
    raws = range(1001, 1501)
    following = baseline([1000] * 500, step_counts=500.0, limit=500)
    nows = [1000 << SCALE_BITS] * 500
    for _ in range(20):
        following.follow(raw(*raws), np.ones(500, dtype=bool))
        nows = [
            n + ((r << SCALE_BITS) - n + 2 >> 2)
            for n, r in zip(nows, raws, strict=True)
        ]
        assert following.counts.tolist() == [(n + 2048) // 4096 for n in nows]


def test_what_is_touched_for_ten_windows_without_a_pause_is_held():
    values = baseline([1000] * 3)
    for t in (0.0, 0.5 * HELD_S, HELD_S - 0.01):
        assert not values.held(np.array([True, t != 0.5 * HELD_S, False]), t).any()
    held = values.held(np.array([True, True, False]), HELD_S)
    assert held.tolist() == [True, False, False]
