"""What is above the threshold without a touch is set aside, and followed once it is
touched."""

from dataclasses import replace

import numpy as np
import pytest

from edge.touch.layout import SkinLayout
from edge.touch.still import WatchfulTracker
from edge.touch.track import ContactTracker
from tests.edge.touch.pressed import pressed

LAYOUT = SkinLayout(8, 8, threshold_counts=40, onset_counts=60, wraps=False)
PERIOD_S = 0.01


def frames(seconds, touches=(), stuck=None):
    """Frames of touches (begin, end) on the middle of the skin, and the stuck counts by
    taxel."""
    stuck = stuck or {}
    for i in range(round(seconds / PERIOD_S)):
        t = i * PERIOD_S
        frame = pressed(LAYOUT, t, {})
        for begin, end in touches:
            if begin <= t < end:
                frame.counts[3:5, 3:5] = 100 + round(200 * min(t - begin, 1.0))
        for place, (since, count) in stuck.items():
            if t >= since:
                frame.counts[place] += count
        yield frame


def watchful(horizon_s):
    return WatchfulTracker(ContactTracker(LAYOUT, horizon_s=horizon_s))


def onsets(stream, horizon_s=1.0):
    """(onset, late) of the contacts of a stream."""
    tracker = watchful(horizon_s)
    contacts = {}
    for frame in stream:
        for contact in tracker.push(frame):
            contacts[contact] = None
    for contact in tracker.finish():
        contacts[contact] = None
    return [(round(contact.onset_s, 3), contact.late) for contact in contacts]


def test_a_touch_under_way_is_late_and_followed_from_the_first_frame():
    stream = [f for f in frames(4.0, ((1.0, 3.0),)) if f.t >= 1.2]
    assert onsets(stream) == [(1.2, True)]


def test_a_touch_under_way_that_grows_is_followed_from_the_first_frame():
    growing = (
        pressed(LAYOUT, i * PERIOD_S, {(3, tuple(range(1 + i // 10))): 100})
        for i in range(80)
    )
    assert onsets(growing) == [(0.0, True)]


def test_a_touch_that_may_be_under_way_is_seen_whole():
    tracker = watchful(1.0)
    for i, count in enumerate((100, 110, 300, 310)):
        tracker.push(pressed(LAYOUT, i * PERIOD_S, {(3, 3): count}))
        assert tracker.latest.counts[3, 3] == count


def test_what_never_changes_is_a_late_contact_where_there_is_no_other():
    """It has the series of the first frames."""
    tracker = watchful(1.0)
    for frame in frames(3.0, stuck={(2, 2): (0.0, 100)}):
        assert tracker.push(frame) == []
    (contact,) = tracker.finish()
    assert contact.late
    assert contact.onset_s == 0.0
    assert contact.series().t[-1] == pytest.approx(1.0)
    assert set(contact.series().peak) == {100}


@pytest.mark.parametrize("dead", [False, True])
def test_a_firm_hold_of_every_taxel_is_a_touch_from_the_first_frame(dead):
    """It is one where a taxel cannot be read, too, and however late it changes."""
    valid = np.ones(LAYOUT.shape, dtype=bool)
    valid[0, 0] = not dead
    stream = []
    for i in range(100):
        frame = pressed(LAYOUT, i * PERIOD_S, {...: 200 if i < 75 else 400})
        stream.append(replace(frame, valid=valid))
    assert onsets(stream) == [(0.0, True)]


def test_a_touch_held_for_the_whole_window_is_not_set_aside_before_its_end():
    tracker = watchful(4.0)
    ended = None
    for frame in frames(7.0, stuck={(3, 3): (0.2, 100)}):
        for contact in tracker.push(frame):
            ended = frame.t if contact.ended else ended
    assert ended is not None
    assert ended > 4.2


def test_gaps_are_no_stillness():
    tracker = watchful(1.0)
    contacts = []
    for t, count in ((0.0, 0), (1.0, 100), (11.0, 100), (21.0, 100)):
        contacts = tracker.push(pressed(LAYOUT, t, {...: count}))
    assert [contact.onset_s for contact in contacts] == [1.0]


@pytest.mark.parametrize(
    ("level", "change", "felt"),
    [(120, 40, 0), (120, 41, 41), (120, -120, 0), (4000, 1000, 0), (4000, 1001, 1001)],
)
def test_more_than_the_threshold_and_a_quarter_of_the_level_is_a_touch(
    level, change, felt
):
    tracker = watchful(1.0)
    for t, count in ((0.0, level), (1.0, level), (1.1, level + change)):
        tracker.push(pressed(LAYOUT, t, {(1, 1): count}))
    assert tracker.latest.counts[1, 1] == felt


def test_a_touch_of_what_is_set_aside_is_followed_without_its_level():
    tracker = watchful(1.0)
    for t, count in ((0.0, 500), (1.0, 510), (1.1, 800), (1.2, 810)):
        contacts = tracker.push(pressed(LAYOUT, t, {(2, (2, 3)): count}))
    assert [contact.series().peak.tolist() for contact in contacts] == [[290, 300]]


def test_a_quiet_taxel_is_taken_back():
    tracker = watchful(1.0)
    aside = []
    for i in range(5):
        tracker.push(pressed(LAYOUT, 0.4 * i, {(1, 1): 50 if i < 2 else 30}))
        aside.append(bool(tracker.aside.any()))
    assert aside == [False, True, True, False, False]
