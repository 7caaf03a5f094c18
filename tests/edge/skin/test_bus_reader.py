"""The fault campaign in short (`python -m bench.faults` runs all of it and prints the table)."""

import errno
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bench.faults import FRAMES_BACK, KINDS, Fault, Pattern, run, scripts, skins, sweep
from edge.classifier import Classifier
from edge.commands.run import chip_event
from edge.events import Decided
from edge.fake.player import Playback, fake_skin
from edge.i2c.bus import BusArbitration, bus_error
from edge.model.model import Model
from edge.recording import load
from edge.skin import file as skinfile
from edge.skin.bus_reader import STEPS_PER_FRAME, Persistent
from edge.skin.loop import Loop
from edge.skin.slot import ChipState

ROWS = {name: (file, faults, more) for name, file, faults, more in scripts()}
UNKNOWABLE = [name for name in ROWS if name.endswith("*")]
"""The protocol has nothing that would tell these."""
TIMEOUT_TICKS = 3
"""Ticks that one timeout of 20 ms can cost at 100 Hz."""


@pytest.mark.parametrize("name", [n for n in ROWS if n not in UNKNOWABLE])
def test_a_fault_loses_no_more_than_it_must(name):
    file, faults, more = ROWS[name]
    outcome = run(name, file, faults, seconds=2.2, **more)
    assert outcome.escaped == ""
    assert outcome.met > 0
    assert outcome.wrong == 0
    assert outcome.others == 0
    hangs = [f for f in faults if f.code == errno.ETIMEDOUT and f.kind == "error"]
    if not hangs:
        assert (outcome.missed, outcome.late_s) == (0, pytest.approx(0.0, abs=1e-9))
        assert outcome.recovery_s < 0.15
    else:
        assert outcome.missed <= TIMEOUT_TICKS * outcome.met
        assert outcome.recovery_s < 1.05


@pytest.mark.parametrize("name", ["NACK on one chip", "EIO on one chip", "a hung chip (ETIMEDOUT)"])
def test_one_bad_chip_costs_its_own_taxels_only(name):
    file, faults, more = ROWS[name]
    assert run(name, file, faults, seconds=1.2, **more).missing == 12


def test_a_hung_chip_costs_its_timeout_and_is_then_tried_less_and_less():
    file, faults, more = ROWS["a hung chip (ETIMEDOUT)"]
    outcome = run("", file, faults, seconds=1.2, **more)
    assert outcome.met <= 4
    assert outcome.missed <= 2 * outcome.met


def test_a_bus_on_which_nothing_answers_rests_longer_each_time():
    file = skins()["cody"]
    with fake_skin(file, Pattern(file)) as skin:
        reader, pauses = skin.readers[0], []
        for _ in range(4):
            reader._give_up(read_any=False)
            pauses.append(reader._resting_until - reader.bus.now())
    assert pauses == pytest.approx([0.05, 0.2, 0.8, 1.0])


def test_a_frame_takes_so_many_steps_at_most_to_bring_chips_back():
    file = skins()["cody"]
    taken = []
    with fake_skin(file, Pattern(file)) as skin:
        reader = skin.readers[0]
        reader.slots[0].state = ChipState.DOWN
        reader._step = lambda slot: taken.append(slot) or True
        reader._revive(math.inf)
    assert taken == [reader.slots[0]] * STEPS_PER_FRAME


SKINS = skins()
EVERY = {
    "frame": {"cody": 97, "one bus at 40 Hz": 97},
    "set-up": {"cody": 401, "one bus at 40 Hz": 401},
}
"""Here only one position in so many, another for each kind; `python -m bench.faults` tries all."""


@pytest.mark.parametrize("name", SKINS)
@pytest.mark.parametrize("where", ["frame", "set-up"])
def test_one_fault_anywhere_gives_no_wrong_value_and_is_over_in_ten_frames(name, where):
    for k, kind in enumerate(KINDS):
        every = EVERY[where].get(name, 23)
        at = {"set_up": where == "set-up", "every": every, "offset": 31 * k % every}
        found = sweep(name, SKINS[name], kind, **at)
        assert (found.wrong, found.escaped) == (0, ""), found
        assert found.frames <= FRAMES_BACK, found


def test_a_frame_that_breaks_off_before_its_last_byte_is_read_again():
    """All other bytes are whole, and what is left of the last value might be one."""
    file = SKINS["cody"]
    feels = Pattern(file)
    met = wrong = 0
    with fake_skin(file, feels, timed=True) as skin:
        bus = skin.readers[0].bus
        for position in range(15):
            bus.inject([replace(KINDS["a frame that breaks off"], at=[position])], 0)
            bus.script.random = SimpleNamespace(randrange=lambda n: n - 1)
            wrong += feels.wrong(skin.read())
            met += bus.script.met
    assert (met, wrong) == (15, 0)


@pytest.mark.parametrize("position", [17, 18, 40])
def test_an_error_during_set_up_leaves_no_taxel_dead(position):
    """One register tells that a chip is set up: it must not be believed after half of a set-up."""
    file, feels = SKINS["cody"], Pattern(SKINS["cody"])
    with fake_skin(file, feels, timed=True) as skin:
        for bus in (reader.bus for reader in skin.readers):
            for chip in bus.chips[0x70].channels[0].values():
                chip.reset()
            bus.inject([Fault(code=errno.ETIMEDOUT, at=[17 + position])])
        frames = list(Loop(skin, lasts_s=0.4).frames())
        assert skin.readers[0].bus.script.met == 1
    assert frames[-1].valid.all()
    assert sum(feels.wrong(frame) for frame in frames) == 0


@pytest.mark.parametrize("name", SKINS)
def test_after_a_brown_out_all_chips_are_back_within_ten_frames(name):
    file = SKINS[name]
    with fake_skin(file, Pattern(file), timed=True) as skin:
        start, back = skin.clock.now(), 0
        for k in range(25):
            skin.clock.sleep_until(start + k / file.reading.rate_hz)
            if k == 3:
                for reader in skin.readers:
                    for chip in reader.bus.chips.values():
                        for behind in [chip, *getattr(chip, "channels", [])]:
                            for one in behind.values() if isinstance(behind, dict) else [behind]:
                                one.reset()
            back = k if not skin.read().valid.all() else back
    assert back - 3 < FRAMES_BACK


def test_a_chip_that_converts_nothing_though_its_settings_read_well_is_set_up_again():
    file = SKINS["cody"]
    with fake_skin(file, Pattern(file)) as skin:
        chip = skin.readers[0].bus.chips[0x70].channels[1][0x2D]
        chip._registers[0x80] ^= 1  # a register that the check of its settings does not read
        chip._converts = None
        states = [skin.read() and skin.readers[0].slots[5].recoveries for _ in range(40)]
        assert skin.read().valid.all()
    assert states[-1] == 1


@pytest.mark.parametrize("fails", [False, True])
def test_the_failure_of_one_chip_lets_its_neighbours_be_checked_at_once(fails):
    """What took its power may have taken theirs, and their values may look plausible."""
    file = replace(SKINS["cody"], reading=replace(SKINS["cody"].reading, recheck_frames=100_000))
    asked = set()
    with fake_skin(file, Pattern(file), timed=True) as skin:
        reader = skin.readers[0]
        if fails:
            lost = Fault(code=errno.EBUSY, address=0x2C, channel=0, during=(1.0, 1.015))
            reader.bus.inject([lost])
        for i, slot in enumerate(reader.slots):
            slot.chip.healthy = lambda i=i: asked.add(i) or True
        for k in range(12):
            skin.clock.sleep_until(1.0 + k / 100)
            skin.read()
    assert (asked >= set(range(1, 12))) is fails


def test_without_reading_back_a_wrong_channel_gives_wrong_values():
    """The campaign can see them: the 20 bits of reading back are not for nothing."""
    name = "the same without reading back *"
    file, faults, more = ROWS[name]
    assert run(name, file, faults, seconds=1.2, **more).wrong > 100


def test_the_same_seed_gives_the_same_outcome():
    file, faults, _ = ROWS["random errors, 1.0% of transactions"]
    first, again, other = (run("", file, faults, seed=s, seconds=1.2) for s in (3, 3, 4))
    assert first == again or (math.isnan(first.recovery_s) and first.met == again.met)
    assert first.met != other.met


def test_a_decision_made_with_missing_taxels_says_so(recordings, exported):
    """A chip far from the contact does not answer for half a second of it."""
    trial = load(recordings / "hard_0.npz")
    model = Model(exported / "model.onnx")
    file = replace(skinfile.load(skinfile.shipped("cody")), layout=trial.layout)
    lost = [Fault(bus=file.buses[0].device, channel=0, address=0x2C, during=(0.5, 1.0))]
    for faults, flagged in (((), False), (lost, True)):
        playback = Playback(trial)
        with fake_skin(file, playback, faults=faults) as skin:
            classifier = Classifier(model, skin.layout)
            loop = Loop(skin, joints=playback, lasts_s=playback.ends)
            events = [event for frame in loop.frames() for event in classifier.push(frame)]
            changed = [status.state for status in skin.changes()]
        decisions = [e for e in events if isinstance(e, Decided)]
        assert ["missing_taxels" in e.flags for e in decisions] == [flagged] * 2
        assert decisions[0].label == trial.labels["category"]
        assert changed == []  # it came back before anyone asked


def test_the_user_hears_of_a_chip_that_fails_and_comes_back():
    cody = skinfile.load(skinfile.shipped("cody"))
    quiet = np.zeros((16, 24), dtype=np.uint16)
    lost = Fault(bus=cody.buses[1].device, channel=1, address=0x2E, during=(0.1, 0.2))
    heard = []
    with fake_skin(cody, lambda t: quiet, faults=[lost]) as skin:
        for frame in Loop(skin, lasts_s=0.5).frames():
            heard += [chip_event(status, round(frame.t, 3)) for status in skin.changes()]
    assert [(e["t"], e["state"], e["place"]) for e in heard] == [
        (0.1, "down", "mux 0x70 channel 1 address 0x2e"),
        (heard[1]["t"], "running", "mux 0x70 channel 1 address 0x2e"),
    ]
    assert heard[0]["error"].endswith(
        "does not answer; check its power, wiring and address (EREMOTEIO)"
    )
    assert "error" not in heard[1]
    assert 0.2 < heard[1]["t"] <= 0.3


def test_a_chip_that_never_comes_back_stays_out_and_costs_nothing():
    cody = skinfile.load(skinfile.shipped("cody"))
    forever = Fault(bus=cody.buses[0].device, channel=0, address=0x2C)
    outcome = run("", cody, [forever], seconds=1.5)
    assert (outcome.missing, outcome.missed, outcome.escaped) == (12, 0, "")
    assert math.isnan(outcome.recovery_s)


def test_a_transaction_is_sent_again_as_often_as_its_error_allows():
    file = skins()["cody"]
    with fake_skin(file, Pattern(file)) as skin:
        reader = skin.readers[0]
        sent = []

        def lost(prepared):
            sent.append(prepared)
            raise bus_error(errno.EAGAIN, "a bus")

        held = SimpleNamespace(
            name="", now=None, sleep=None, prepare=None, reopen=None, close=None, transfer=lost
        )
        reader.retries = 12
        with pytest.raises(BusArbitration):
            Persistent(held, reader).transfer(None)
    assert (len(sent), reader.retries) == (1 + 3, 12 - 3)
