"""Reading the chips near a contact: the choice, and its difference from reading every
chip."""

from dataclasses import replace

import numpy as np
import pytest

from edge.fake.player import Playback, fake_skin
from edge.recording import load
from edge.skin import file as skinfile
from edge.skin.loop import Loop
from edge.skin.read_scheduler import ReadScheduler, with_neighbours
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.track import ContactTracker
from tests.faulty import one_bus

CODY = skinfile.load(skinfile.shipped("cody"))
ONE = one_bus(CODY)
SCHEDULED = replace(ONE, reading=replace(ONE.reading, region_of_interest=True))


@pytest.fixture
def scheduler():
    return ReadScheduler(ONE)


def touched(*places):
    counts = np.zeros((16, 24), dtype=np.uint16)
    for row, col in places:
        counts[row, col] = 3000
    return Frame(t=0.0, counts=counts)


def chips_at(*places):
    wanted = {row * 24 + col for row, col in places}
    return {i for i, chip in enumerate(ONE.chips) if wanted & set(chip.taxels)}


def test_while_nothing_touches_13_chips_come_in_turn(scheduler):
    """As many as a bus of 400 kHz carries at 100 Hz."""
    read = [set(scheduler.plan(touched(), 200)[0]) for _ in range(9)]
    assert {len(chips) for chips in read} == {13}
    for k in range(6):
        assert set.union(*read[k : k + 3]) == set(range(32))


# Row 3 is the last of its chip: the next chip, one taxel away, belongs to the
# neighbourhood.
@pytest.mark.parametrize(
    ("contact", "neighbour"),
    [
        pytest.param((3, 4), (4, 4), id="next chip"),
        pytest.param((8, 0), (8, 23), id="seam"),
    ],
)
def test_chips_near_a_contact_are_read_in_every_frame(scheduler, contact, neighbour):
    near = chips_at(contact, neighbour)
    assert len(near) == 2
    for _ in range(20):
        assert near <= set(scheduler.plan(touched(contact), 200)[0])


def test_away_from_the_contact_no_chip_is_forgotten(scheduler):
    frame = touched(*[(row, col) for row in range(4, 8) for col in range(6, 12)])
    last = np.zeros(32, dtype=int)
    oldest = 0
    for tick in range(1, 200):
        last[scheduler.plan(frame, 200)[0]] = tick
        oldest = max(oldest, int((tick - last).max()))
    assert oldest <= 20


def test_a_contact_larger_than_the_wire_is_read_in_turn(scheduler):
    frame = Frame(t=0.0, counts=np.full((16, 24), 3000, dtype=np.uint16))
    read = [set(scheduler.plan(frame, 200)[0]) for _ in range(6)]
    assert set.union(*read[:3]) == set(range(32))
    assert all(len(chips) >= 12 for chips in read)


def test_a_wire_too_slow_for_one_chip_still_reads_one():
    slow = replace(ONE, buses=(replace(ONE.buses[0], clock_hz=10_000),))
    scheduler = ReadScheduler(slow)
    seen = [scheduler.plan(None)[0] for _ in range(32)]
    assert sorted(i for chips in seen for i in chips) == list(range(32))


def test_every_plan_fits_the_period():
    """Timed by the bits on the wire, mux and settings' checks included, no tick is
    late."""
    draw = np.random.default_rng(0)
    patches = np.zeros((40, 16, 24), dtype=np.uint16)
    for patch in patches:
        row, col = draw.integers(0, 12), draw.integers(0, 24)
        patch[row : row + 4, [(col + i) % 24 for i in range(5)]] = 2000
    with fake_skin(SCHEDULED, lambda t: patches[int(t * 20) % 40], timed=True) as skin:
        worst = 0.0
        for k, frame in enumerate(Loop(skin, lasts_s=2.0).frames()):
            worst = max(worst, skin.clock.now() - frame.t)
            assert frame.valid.all() or k < 3
    assert worst < 0.01


def test_a_taxel_keeps_its_value_and_its_own_time_until_it_is_read_again():
    flat = np.full((16, 24), 700, dtype=np.uint16)
    quiet = np.zeros((16, 24), dtype=np.uint16)
    with fake_skin(
        SCHEDULED, lambda t: flat if t < 0.05 else quiet, timed=True
    ) as skin:
        for frame in Loop(skin, lasts_s=0.12).frames():
            # A taxel's value was felt at its own time, a conversion ago at most.
            old = frame.valid & (frame.counts == 700)
            new = frame.valid & (frame.counts == 0)
            assert (frame.times[old] < 0.05 + 0.0093).all()
            assert (frame.times[new] >= 0.05).all()
            assert (old | new)[frame.valid].all()
    assert new.all()


def test_masks_grow_across_the_seam_only_where_there_is_one():
    mask = np.zeros((1, 3, 4), dtype=bool)
    mask[0, 1, 0] = True
    assert with_neighbours(mask, True)[0].astype(int).tolist() == [[1, 1, 0, 1]] * 3
    assert with_neighbours(mask, False)[0].astype(int).tolist() == [[1, 1, 0, 0]] * 3


def felt(file, recording, info):
    """The features of the first contact, and its onset in seconds; no tick is left
    out."""
    playback = Playback(recording)
    tracker = ContactTracker(
        recording.layout, chain=info.chain, horizon_s=info.window_s
    )
    with fake_skin(
        replace(file, layout=recording.layout), playback, timed=True
    ) as skin:
        playback.start = skin.clock.now()
        loop = Loop(skin, lasts_s=playback.ends, joints=playback)
        contacts = [
            contact for frame in loop.frames() for contact in tracker.push(frame)
        ]
    assert loop.schedule.missed_ticks == 0
    vector = feature_vector(contacts[0].series(), info.window_s)
    return vector, contacts[0].onset_s - playback.start


@pytest.mark.parametrize("name", ["hard_0", "soft_2"])
def test_features_and_decisions_agree_with_full_reading(recordings, model, name):
    trial = load(recordings / f"{name}.npz")
    (full, full_onset_s), (near, onset_s) = (
        felt(f, trial, model.info) for f in (CODY, SCHEDULED)
    )
    # While nothing touches, all chips are read once in three frames.
    assert abs(onset_s - full_onset_s) < 0.03
    force, area, motion = (
        np.abs(near - full).reshape(3, -1)
        / np.ptp(full.reshape(3, -1), axis=1)[:, None]
    )
    # With an onset as late as that, force and motion are within 5 % of their range.
    # Area rises in steps, which may come 10 ms early or late.
    assert max(force.mean(), motion.mean()) < 0.025
    assert area.mean() < 0.05
    labels = [{t: d.label for t, d in model.decide(v).items()} for v in (full, near)]
    assert labels[0] == labels[1]
