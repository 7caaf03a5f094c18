"""The skin meets the faults of its buses (`python -m tests.checks.faults` plays all of
them)."""

import errno
from dataclasses import replace

import numpy as np
import pytest

from edge.wire.bus.protocol import BusRefused
from edge.wire.bus.retrying import LONGEST_REST_S, RESTS
from edge.wire.chips.ad7147 import DEVICE_ID, IDENTIFIED_EVERY
from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import calibrated
from edge.wire.skin.bus_reader import SET_UP_AFTER, SET_UP_EVERY, BusReader
from edge.wire.skin.loop import Loop
from edge.wire.skin.skin import SILENT_FRAMES, Skin
from tests.checks.faults import (
    BACK_S,
    KINDS,
    LEAST_BESIDE,
    LEAST_VALID,
    REPEATED,
    SHARES,
    SKINS,
    Pattern,
    Watched,
    run,
    scripts,
    share,
    spared,
    sweep,
)
from tests.faulty import Fault, faulty_buses, faulty_skin, one_bus


def shrunk(file):
    """Cody's skin with two of its buses, each with two chips on two of its channels."""
    taxels = iter(np.arange(8 * 12).reshape(8, 12).tolist())
    buses = []
    for bus in file.buses[:2]:
        chips = [
            replace(bus.chips[i], taxels=tuple(next(taxels))) for i in (0, 1, 4, 5)
        ]
        buses.append(replace(bus, chips=tuple(chips)))
    layout = replace(file.layout, rows=4)
    file = replace(file, layout=layout, buses=tuple(buses), calibration=None)
    return calibrated(file)


CODY = SKINS["cody"]
SMALL = shrunk(CODY)
SWEPT = {
    "cody": (SMALL, 23, 61),
    "mpr121": (SKINS["mpr121"], 23, 61),
    "one bus": (one_bus(SMALL), 23, 61),
    "block": (SKINS["block"], 3, 2),
}
"""Skins; one position in so many of a frame and of the set-up is tried."""
ROWS = {name: (file, faults) for name, file, faults in scripts()}
UNKNOWABLE = [name for name in ROWS if name.endswith("*")]
"""The protocol has nothing that would tell these."""
QUIET = np.zeros((4, 24), dtype=np.uint16)


def hang(faults):
    """Whether one of the faults lasts until the bus's timeout."""
    return any(f.code == errno.ETIMEDOUT and f.kind == "error" for f in faults)


@pytest.mark.parametrize("name", [n for n in ROWS if n not in UNKNOWABLE])
def test_a_fault_gives_no_wrong_value_and_costs_no_other_chip(name):
    file, faults = ROWS[name]
    enough = SMALL if file is CODY and faults[0].rate == 1.0 else file
    outcome = run(name, enough, faults, seconds=1.6)
    assert outcome.met > 0
    assert outcome.wrong == 0
    assert outcome.elsewhere == 0
    assert outcome.back_s < BACK_S
    assert outcome.missed_ticks <= 3 * outcome.met * hang(faults)


@pytest.mark.parametrize("overhead_us", [0, 100])
@pytest.mark.parametrize("name", SKINS)
def test_after_a_brown_out_every_taxel_is_back_in_half_a_second_also_when_it_repeats(
    name, overhead_us
):
    for resets in (REPEATED[:1], REPEATED[:3]):
        lasts = {"seconds": (resets[-1] + 60) / SKINS[name].reading.rate_hz}
        outcome = run(
            name,
            SKINS[name],
            resets=resets,
            overhead_s=overhead_us * 1e-6,
            **lasts,
        )
        assert outcome.wrong == 0
        assert outcome.back_s <= BACK_S
        assert outcome.missed_ticks == 0


@pytest.mark.parametrize("name", SWEPT)
@pytest.mark.parametrize("set_up", [False, True])
def test_one_fault_anywhere_gives_no_wrong_value(name, set_up):
    """Other positions are tried for each kind."""
    file, *steps = SWEPT[name]
    every = steps[set_up]
    for k, fault in enumerate(KINDS.values()):
        at = {"set_up": set_up, "every": every, "first": 31 * k % every}
        outcome = sweep(name, file, fault, overhead_s=100e-6, **at)
        assert outcome.met > 0, fault
        assert outcome.wrong == 0, fault
        assert outcome.back_s < BACK_S, fault


def test_no_result_depends_on_registers_that_power_up_leaves_undefined():
    def frames(seed):
        clock = VirtualClock()
        feels = Pattern(CODY)
        buses = faulty_buses(CODY, feels, clock, timed=True, seed=seed)
        with Skin(CODY, buses, clock=clock) as skin:
            skin.start()
            skin.readers[0].bus.chips[0x70].channels[1][0x2D].reset()
            return [skin.read().counts for _ in range(8)]

    np.testing.assert_array_equal(frames(0), frames(1))


@pytest.fixture
def running():
    """A skin, the model of one of its chips, and the chip's slot."""
    with faulty_skin(SMALL, Pattern(SMALL)) as skin:
        first = skin.readers[0]
        yield skin, first.bus.chips[0x70].channels[1][0x2D], first.slots[3]


@pytest.mark.parametrize("channels", [0, 1 << 3, 1 << 0 | 1 << 1])
def test_the_next_frame_after_another_program_selected_channels_is_valid(
    running, channels
):
    skin, _, _ = running
    for reader in skin.readers:
        mux = reader.bus.chips[0x70]
        mux.write(bytes([channels]), 0.0)
        mux.stop()
    frame = skin.read()
    assert frame.valid.all()
    assert Pattern(SMALL).wrong(frame) == 0


def test_the_only_channel_of_a_mux_is_selected_again_within_the_frame():
    buses = [replace(bus, chips=bus.chips[:2]) for bus in SMALL.buses]
    file = replace(SMALL, buses=tuple(buses))
    with faulty_skin(file, Pattern(file), timed=True) as skin:
        skin.read()
        for reader in skin.readers:
            mux = reader.bus.chips[0x70]
            mux.write(bytes([1 << 3]), 0.0)
            mux.stop()
        frame = skin.read()
    assert frame.valid.sum() == 4 * 12
    assert Pattern(file).wrong(frame) == 0


def test_after_a_frame_each_selection_is_read_back_again(running):
    skin, _, _ = running
    skin.read()
    for reader in skin.readers:
        assert [mux.verify for mux in reader._muxes.values()] == [True]


def test_a_damaged_stage_register_is_found_by_reading_the_stages_in_turn(running):
    """13 rows of 4 chips, one every 4 frames; the values meanwhile look plausible."""
    skin, model, slot = running
    model.write(b"\0\x81\x12\x34", 0.0)
    for _ in range(13 * 4 * 4):
        skin.read()
    assert slot.running
    assert model.registers[0x81] == 0x1FFF


def test_another_chip_at_an_address_gives_no_value_from_the_next_look_at_its_identity(
    running,
):
    skin, model, slot = running
    taxels = list(slot.spec.taxels)
    model.registers[DEVICE_ID] = 0x1492
    valid = [skin.read().valid.flat[taxels].any() for _ in range(IDENTIFIED_EVERY)]
    assert not valid[-1]
    for _ in range(SET_UP_AFTER + 1):
        assert not skin.read().valid.flat[taxels].any()
    assert "its identity reads 0x1492, not 0x147x" in str(slot.error)


def test_a_chip_that_keeps_its_settings_but_converts_nothing_is_set_up_again_now_and_then(
    running,
):
    skin, model, slot = running
    model._sense = lambda t: np.zeros(12, dtype=np.uint16)
    set_up_in = []
    for frame in range(1, SET_UP_AFTER + SET_UP_EVERY + 10):
        driver = slot.chip
        skin.read()
        set_up_in += [] if slot.chip is driver else [frame]
    assert set_up_in == [SET_UP_AFTER + 1, SET_UP_AFTER + SET_UP_EVERY + 1]


def test_an_adapter_that_refuses_the_drivers_transactions_is_an_error_at_the_start():
    clock = VirtualClock()
    refused = [Fault(code=errno.EOPNOTSUPP)]
    buses = faulty_buses(SMALL, lambda t: QUIET, clock, faults=refused)
    rows = [np.zeros(26, np.uint8)] * 4
    with pytest.raises(BusRefused, match="refuses a transaction of this shape"):
        BusReader(buses[0], SMALL.buses[0], rows, SMALL.reading).start()


def changes(skin, seconds):
    """Time and status of each chip whose state changes."""
    frames = Loop(skin, lasts_s=seconds).frames()
    return [
        (round(frame.t, 3), status) for frame in frames for status in skin.changes()
    ]


def test_the_user_hears_of_a_chip_that_fails_and_comes_back():
    lost = Fault(bus=SMALL.buses[1].device, channel=1, address=0x2D, during=(0.1, 0.2))
    with faulty_skin(SMALL, lambda t: QUIET, faults=[lost]) as skin:
        skin.readers[1].bus.reopen = pytest.fail  # the bus's other chips run
        (failed_at, down), (back_at, up) = changes(skin, 0.7)
    assert failed_at == 0.1
    assert down.state == "down"
    assert down.spec.address == 0x2D
    assert down.error.endswith("check its power, wiring and address (EREMOTEIO)")
    assert up.state == "running"
    assert up.error == ""
    assert back_at == pytest.approx(0.1 + SILENT_FRAMES * 0.01)


def test_a_loose_wire_is_told_twice_a_second_at_most():
    """It breaks and holds ten times a second."""
    chip = {"bus": SMALL.buses[1].device, "channel": 1, "address": 0x2D}
    loose = [Fault(**chip, during=(0.1 * k, 0.1 * k + 0.05)) for k in range(1, 31)]
    with faulty_skin(SMALL, lambda t: QUIET, faults=loose) as skin:
        reports = [status.state for _, status in changes(skin, 3.6)]
    assert reports[0] == "down"
    assert reports[-1] == "running"
    assert len(reports) <= 8


@pytest.mark.parametrize("kind", SHARES)
def test_faults_of_one_in_five_cost_few_frames(kind):
    assert share(kind, 0.2, seconds=2.0).read >= LEAST_VALID[0.2]


def test_a_chip_that_hangs_costs_the_others_few_frames():
    kind = "timeouts of one AD7147"
    assert share(kind, 1.0, seconds=2.0).beside >= LEAST_BESIDE


def hanging(number, **more):
    """A hang of a chip of the first bus."""
    place = {k: getattr(SMALL.chips[number], k) for k in ("address", "mux", "channel")}
    return Fault(code=errno.ETIMEDOUT, bus="/dev/i2c-1", **place, **more)


def test_two_chips_that_hang_in_different_frames_take_no_other_chip_down():
    hangs = [hanging(0, during=(0.1, 0.11)), hanging(1, during=(0.6, 0.61))]
    assert run("", SMALL, hangs, seconds=1.0).elsewhere == 0


def test_two_chips_that_hang_at_the_start_take_no_other_chip_down():
    hangs = [hanging(2), hanging(3)]
    watched = Watched(SMALL, faults=hangs)
    watched.spared = spared(SMALL, hangs)
    with watched.skin:
        watched.read()
    assert watched.elsewhere == 0


def test_a_bus_that_hangs_is_tried_seldom_and_is_back_soon_after():
    """Two chips hang in one frame, so that no third one is tried."""
    hangs = Fault(code=errno.ETIMEDOUT, during=(0.1, 3.1))
    with faulty_skin(SMALL, Pattern(SMALL), timed=True) as skin:
        bus = skin.readers[0].bus
        start = skin.clock.now()
        bus.inject([hangs.later(start)])
        frames = list(Loop(skin, lasts_s=4.0).frames())
    last = max(frame.t for frame in frames if not frame.valid.all())
    assert last - start < 3.1 + BACK_S
    assert bus.met <= 3 + 3.0 / RESTS / bus.timeout_s


def test_a_lost_bus_is_opened_again_and_again_and_both_changes_are_heard():
    """As an adapter that is unplugged: the kernel wants its device closed."""
    name = SMALL.buses[1].device
    gone = Fault(code=errno.EIO, bus=name, during=(0.1, 4.0))
    opened = []
    reports = []
    with faulty_skin(SMALL, lambda t: QUIET, faults=[gone]) as skin:
        bus = skin.readers[1].bus
        reopen = bus.reopen
        bus.reopen = lambda: (opened.append(bus.now()), reopen())
        for frame in Loop(skin, lasts_s=5.0).frames():
            reports += [(round(frame.t, 3), *change) for change in skin.bus_changes()]
    rests = np.diff([t for t in opened if t > 0.5])
    assert rests == pytest.approx(LONGEST_REST_S, abs=0.011)
    (lost_at, *lost), (back_at, *back) = reports
    assert 0.1 <= lost_at < 0.2
    assert lost == [name, True]
    assert back == [name, False]
    assert 4.0 <= back_at <= 4.0 + LONGEST_REST_S + 0.01
