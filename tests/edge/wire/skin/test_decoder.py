"""From bytes to trusted values: which taxels are valid, and which chips are doubted."""

import math
from dataclasses import replace

import numpy as np
import pytest

from edge.wire.chips import block, mpr121
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses, fake_skin, still
from edge.wire.skin.decoder import NEVER_STUCK, repeat_chance, stuck_limits
from edge.wire.skin.file import Reading, TaxelCalibration
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
