"""The skin over the fake: frames put together from buses, chips and stages."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest

from edge.errors import EdgeError, InputError
from edge.wire.bus.protocol import BusMissing
from edge.wire.chips import ad7147
from edge.wire.chips.block import UNCHANGED_FRAMES
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated, fake_buses, fake_skin, frame_bits, still
from edge.wire.skin import file as skinfile
from edge.wire.skin.decoder import HELD_S
from edge.wire.skin.file import Reading
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import SILENT_FRAMES, Skin, SystemClock
from edge.wire.skin.wiring import BusSpec
from tests.checks.faults import SKINS
from tests.edge.wire.skin.small import CHIP, CODY, PICTURE
from tests.faulty import Fault, faulty_buses, faulty_skin

PAD = skinfile.load(skinfile.shipped("mpr121"))


def on_one_bus():
    """The 32 chips of Cody's skin on one bus, without checks."""
    chips = []
    for i, chip in enumerate(CODY.chips):
        channel, a = divmod(i, 4)
        address = ad7147.AD7147.addresses[0] + a
        chips.append(replace(chip, channel=channel, address=address))
    reading = Reading(verify_mux=False, recheck_frames=100_000)
    return replace(CODY, buses=(BusSpec("bus 0", tuple(chips)),), reading=reading)


def test_all_checks_together_cost_at_most_4_percent_of_the_wire():
    assert sum(frame_bits(CODY)) <= 1.04 * 8320


def test_buses_are_read_side_by_side_each_in_a_thread(monkeypatch):
    """Each bus waits in the middle of its frame until all have come so far."""
    with still(CODY) as skin:
        together = threading.Barrier(3, timeout=30.0)
        for reader in skin.readers:
            chip = reader.slots[4].chip
            monkeypatch.setattr(
                chip,
                "read",
                lambda r=chip.read: (together.wait(), r()),
            )
        assert skin.read().valid.all()


def test_a_frame_is_a_rolling_shutter_and_says_so():
    """On one bus at 400 kHz the last chip is read 20 ms after the first, in wire
    order."""
    file = on_one_bus()
    with fake_skin(file, lambda t: PICTURE, timed=True) as skin:
        frame = skin.read()
        following = skin.read()
    times = np.array([frame.times.reshape(-1)[chip.taxels[0]] for chip in file.chips])
    assert (np.diff(times) > 0).all()
    assert times[0] - frame.t == pytest.approx((20 + 255) / 400e3)
    assert times[-1] - times[0] == pytest.approx((31 * 255 + 7 * 20) / 400e3)
    assert following.t - frame.t == pytest.approx(8320 / 400e3)
    assert len(np.unique(frame.times)) == 32


def test_the_baseline_follows_drift_until_something_touches():
    """15 counts a second of drift, then a contact on top of it, held for two
    seconds."""
    contact = np.zeros((16, 24), dtype=np.uint16)
    contact[:2, :2] = 3000
    with fake_skin(
        CHIP, lambda t: np.uint16(15.0 * t) + contact * (4.0 <= t < 6.0)
    ) as skin:
        frames = list(Loop(skin, lasts_s=6.5).frames())
    quiet = [int(frame.counts.max()) for frame in frames if frame.t < 4.0]
    held = [int(frame.counts[1, 1]) for frame in frames if 4.0 <= frame.t < 6.0]
    assert max(quiet) <= 4
    # Frozen: the drift adds to the contact, and nothing of the contact is lost.
    assert held[0] in range(2999, 3005)
    assert held[-1] - held[0] in range(28, 32)


def test_the_baseline_follows_what_is_held_for_ten_windows():
    leant = np.zeros((16, 24), dtype=np.uint16)
    leant[:2, :2] = 300
    with fake_skin(CHIP, lambda t: leant * (t >= 1.0)) as skin:
        counts = {
            round(f.t, 2): f.counts[1, 1] for f in Loop(skin, lasts_s=16.0).frames()
        }
    start = min(counts)
    assert [counts[round(start + s, 2)] for s in (1.1, 12.9)] == [300, 300]
    assert counts[round(start + 15.0, 2)] in range(258, 263)


def test_a_skin_whose_only_chip_does_not_answer_says_so():
    clock = VirtualClock()
    file = replace(calibrated(PAD), buses=(replace(PAD.buses[0], chips=PAD.chips[:1]),))
    buses = faulty_buses(file, lambda t: PICTURE, clock, faults=[Fault()])
    skin = Skin(file, buses, clock=clock)
    with (
        skin,
        pytest.raises(
            EdgeError, match="no chip of the skin 'mpr121 pad' answers: /dev/i2c"
        ),
    ):
        skin.start()


def test_closing_twice_is_fine_and_ends_the_threads():
    before = threading.active_count()
    skin = still(CODY)
    skin.read()
    assert threading.active_count() > before
    skin.close()
    skin.close()
    assert threading.active_count() == before


def test_a_skin_without_calibration_is_opened_only_to_measure_it(monkeypatch):
    def absent(*spec):
        raise BusMissing("no such bus")

    monkeypatch.setattr("edge.wire.skin.skin._open", absent)
    with pytest.raises(
        InputError, match="has no calibration; run `edge-classify calibrate"
    ):
        Skin.open(CODY)
    for file, calibration in ((CODY, False), (calibrated(CODY), True)):
        with pytest.raises(BusMissing):
            Skin.open(file, calibrated=calibration)


def test_taxels_that_fall_silent_are_heard_of_and_so_is_their_return():
    """A microcontroller serves one frame for 1.5 s, while its bus and its CRC are
    intact."""
    file = SKINS["block"]
    hangs = Fault("hold", bus=file.buses[1].device, during=(0.1, 1.6))
    reports = []
    with faulty_skin(file, lambda t: PICTURE, [hangs]) as skin:
        for frame in Loop(skin, lasts_s=2.0).frames():
            silent = skin.silent_changes()
            reports += [] if silent is None else [(round(frame.t, 2), silent)]
    hung_s = (UNCHANGED_FRAMES + SILENT_FRAMES) * 0.01
    assert reports == [
        (pytest.approx(0.1 + hung_s, abs=0.021), 128),
        (pytest.approx(1.6), 0),
    ]


def test_a_skin_without_calibration_follows_no_drift():
    """Not even what is held for ten windows."""
    file = replace(CHIP, calibration=None)
    clock = VirtualClock()
    buses = fake_buses(file, lambda t: PICTURE, clock)
    with Skin(file, buses, clock=clock) as skin:
        skin.start()
        before = skin.baseline.counts
        frames = list(Loop(skin, lasts_s=HELD_S + 1.0).frames())
        raw, valid = skin.raw()
    np.testing.assert_array_equal(skin.baseline.counts, before)
    np.testing.assert_array_equal(frames[-1].counts, raw * valid)


def test_dead_taxels_are_not_silent():
    signal = replace(CODY.signal, dead=((0, 0), (3, 4)))
    with still(replace(CODY, signal=signal)) as skin:
        assert not skin.read().valid[3, 4]
        assert not skin.invalid_for.any()


def test_it_returns_no_sooner_than_it_was_asked_to():
    clock = SystemClock()
    moment = clock.now() + 0.002
    clock.sleep_until(moment)
    assert clock.now() >= moment


def test_a_moment_that_has_passed_is_not_waited_for(monkeypatch):
    clock = SystemClock()
    slept = []
    monkeypatch.setattr(time, "sleep", slept.append)
    clock.sleep_until(clock.now() - 1.0)
    clock.sleep_until(clock.now())
    assert slept == []
