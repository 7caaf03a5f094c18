"""Contacts that last longer than a touch hide none beside them: broken taxels are named
and ignored, and what leans on the skin is set aside once a touch begins."""

from dataclasses import replace

import numpy as np
import pytest

from edge.recording import Recording
from edge.touch.aside import CHECK_S, QUIET_LOOKS
from edge.touch.still import WatchfulTracker
from edge.touch.track import ContactTracker
from tests.conftest import FOREARM, in_a_row, touch

LAYOUT = replace(FOREARM, threshold_counts=40, onset_counts=60)
WINDOW_S = 1.2
PLACES = ((11, 0), (12, 18), (13, 22), (15, 8))
"""Taxels that no touch reaches."""
ADJACENT = ((12, 19), (12, 20), (13, 19), (13, 20))
TOUCHES = 6
NOISE = np.random.default_rng(65).standard_normal((4, 2000))
CHANCE = np.random.default_rng(66).random((4, 2000))
T = np.arange(2000) / 100.0
BROKEN = {
    "stuck": 500 + 0 * NOISE,
    "noise of 60 about 500": 500 + 60 * NOISE,
    "noise of 600 about 5000": 5000 + 600 * NOISE,
    "noise of 45 about 0": 45 * NOISE,
    "flickers in 20 %": 500 * (CHANCE < 0.2),
    "wanders by 20": 1000 + (20 * NOISE).cumsum(axis=1),
    "swells by 50 a second": 50 * T + 0 * NOISE,
}


def recording(frames):
    """A recording of frames (n, 16, 24) of counts, at 100 Hz."""
    t = np.arange(len(frames)) / 100.0
    counts = np.clip(np.rint(frames), 0, 65535).astype(np.uint16)
    return Recording(t, counts, meta={"skin": LAYOUT.to_dict()})


def touches(begin_s=1.0):
    """Frames of six touches with pauses of a second, as numbers."""
    kinds = ("hard", "soft") * 3
    six = (touch(kind=kind, seed=seed) for seed, kind in enumerate(kinds))
    frames = in_a_row(*six, rest=100).frames.astype(float)
    return np.pad(frames, ((round(begin_s * 100), 0), (0, 0), (0, 0)))


def contacts_of(frames, watchful=True):
    """{onset: its contact} of a recording, and {taxel: when it was first named}."""
    tracker = ContactTracker(LAYOUT, horizon_s=WINDOW_S)
    watched = WatchfulTracker(tracker)
    contacts = {}
    named = {}
    for frame in recording(frames):
        for contact in (watched if watchful else tracker).push(frame):
            contacts[contact.onset_s] = contact
        for place in map(tuple, np.argwhere(watched.aside).tolist()):
            named.setdefault(place, frame.t)
    return contacts, named


def same(contact, expected):
    """Whether two contacts have the same whole numbers."""
    series = contact.series()
    wanted = expected.series()
    return all(
        np.array_equal(getattr(series, name), getattr(wanted, name))
        for name in ("t", "peak", "area", "sums")
    )


def with_taxels(frames, places, counts, since_s=0.0):
    """The frames with counts (places, n) added from a time on."""
    since = round(since_s * 100)
    broken = frames.copy()
    for place, added in zip(places, counts, strict=False):
        broken[since:, *place] += added[: len(frames) - since]
    return broken


@pytest.fixture(scope="module")
def wanted():
    """The contacts of the six touches, without broken taxels."""
    contacts, _ = contacts_of(touches(), watchful=False)
    assert len(contacts) == TOUCHES
    return contacts


@pytest.mark.parametrize("since_s", [0.0, 0.7])
@pytest.mark.parametrize("places", [PLACES[:1], PLACES, ADJACENT])
@pytest.mark.parametrize("kind", BROKEN)
def test_broken_taxels_are_named_and_hide_no_touch(kind, places, since_s, wanted):
    frames = with_taxels(touches(), places, BROKEN[kind], since_s)
    contacts, named = contacts_of(frames)
    followed = [onset for onset in wanted if onset in contacts]
    assert len(followed) >= TOUCHES - 1
    for onset in followed[1:]:
        assert same(contacts[onset], wanted[onset])
    active = frames[:, *np.transpose(places)] > LAYOUT.threshold_counts
    begun_s = active.argmax(axis=0) / 100.0
    late_s = {place: named[place] - s for place, s in zip(places, begun_s, strict=True)}
    assert max(late_s.values()) <= 2.75


def test_a_broken_taxel_is_followed_again_after_ten_quiet_seconds():
    flickers = np.zeros((1, 3000))
    flickers[0, :500] = 500 * (CHANCE[0, :500] < 0.5)
    quiet = np.zeros((3000, *LAYOUT.shape))
    tracker = WatchfulTracker(ContactTracker(LAYOUT, horizon_s=WINDOW_S))
    last_s = 0.0
    for frame in recording(with_taxels(quiet, PLACES[:1], flickers)):
        tracker.push(frame)
        if tracker.aside.any():
            last_s = frame.t
    assert last_s == pytest.approx(5.0 + QUIET_LOOKS * CHECK_S, abs=2 * CHECK_S)


def held(frames, seconds):
    """A touch whose last frame stays for some seconds, with a slow swing and a fast
    tremor of its force."""
    t = np.arange(round(seconds * 100)) / 100.0
    force = 1 + 0.1 * np.sin(3.0 * t) + 0.02 * np.sin(50.0 * t)
    return np.concatenate([frames, frames[-1] * force[:, None, None]])


def lone(frames):
    """The touch on its strongest taxel alone."""
    peaks = frames.max(axis=0)
    return frames * (peaks == peaks.max())


def gliding(frames):
    """The touch, moving around the arm by six taxels a second."""
    steps = (np.arange(len(frames)) * 0.06).astype(int)
    return np.stack([np.roll(f, s, 1) for f, s in zip(frames, steps, strict=True)])


ORDINARY = {
    "short": lambda frames: frames,
    "light": lambda frames: frames * (70.0 / frames.max()),
    "lone": lone,
    "gliding": gliding,
    "long": lambda frames: held(frames, 4.0),
    "long and lone": lambda frames: lone(held(frames, 4.0)),
    "long and light": lambda frames: held(frames * (80.0 / frames.max()), 4.0),
    "long and gliding": lambda frames: gliding(held(frames, 4.0)),
}


@pytest.mark.parametrize("kind", ["hard", "soft"])
@pytest.mark.parametrize("name", ORDINARY)
def test_ordinary_touches_of_one_place_are_followed_as_without_the_watch(name, kind):
    frames = ORDINARY[name](touch(kind=kind).frames.astype(float))
    stream = np.concatenate([np.pad(frames, ((60, 0), (0, 0), (0, 0)))] * 3)
    contacts, _ = contacts_of(stream)
    wanted, _ = contacts_of(stream, watchful=False)
    assert contacts.keys() == wanted.keys()
    assert all(same(contacts[onset], wanted[onset]) for onset in wanted)


def leaning(seconds, rows=slice(11, 15), cols=slice(19, 23), swing=0.0):
    """Frames of someone who leans on some taxels from a second on."""
    t = np.arange(round(seconds * 100)) / 100.0
    frames = np.zeros((len(t), *LAYOUT.shape))
    force = 600 * (1 + swing * np.sin(9.0 * t)) * np.clip(t - 1.0, 0.0, 1.0)
    frames[:, rows, cols] = force[:, None, None]
    return frames


@pytest.mark.parametrize("swing", [0.01, 0.1])
def test_a_push_after_thirty_seconds_of_leaning_is_felt_without_them(swing):
    push = touch().frames.astype(float)
    frames = leaning(33.0, slice(0, 16), slice(0, 24), swing)
    frames[-len(push) :] += push
    contacts, _ = contacts_of(frames)
    first, second = contacts
    assert first == pytest.approx(1.1, abs=0.02)
    assert second == pytest.approx(33.0 - 1.6, abs=0.02)
    peaks = contacts[second].series().peak
    felt = push.max(axis=(1, 2))[20:120]
    assert peaks[:100] == pytest.approx(felt, abs=5 + 1300 * swing)


def test_touches_beside_someone_who_leans_and_sways_are_followed():
    frames = touches(begin_s=5.0)
    leant = leaning(len(frames) / 100.0, swing=0.2)
    _, *contacts = contacts_of(frames + leant)[0].items()
    wanted, _ = contacts_of(frames, watchful=False)
    assert [onset for onset, _ in contacts] == list(wanted)
    assert all(same(contact, wanted[onset]) for onset, contact in contacts)


def test_a_long_contact_goes_on_where_several_are_followed():
    frames = leaning(8.0, swing=0.2)
    frames[500:600, 2:4, 2:4] = 500.0
    tracker = ContactTracker(LAYOUT, horizon_s=WINDOW_S, max_contacts=2)
    watched = WatchfulTracker(tracker)
    contacts = [watched.push(frame) for frame in recording(frames)][-1]
    assert [contact.onset_s for contact in contacts] == [1.12]


def test_a_touch_through_a_sleeve_is_felt_without_the_sleeve():
    """It is a late contact first, as a firm hold of the skin would be."""
    frames = touches(begin_s=4.0)
    wanted, _ = contacts_of(frames, watchful=False)
    contacts, _ = contacts_of(frames + 300.0)
    assert contacts.pop(0.0).late
    assert contacts.keys() == wanted.keys()
    assert all(same(contact, wanted[onset]) for onset, contact in contacts.items())
