"""A broken taxel is told by its neighbours, named, and hides no touch."""

from dataclasses import replace

import numpy as np
import pytest

from edge.fake.player import play, skin_file
from edge.recording import Recording
from edge.skin.lone import LoneTaxels
from edge.skin.loop import Loop
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker

LAYOUT = SkinLayout(8, 8, threshold_counts=40, onset_counts=60)
N = 560
T = np.arange(N) / 100.0
NOISE = np.random.default_rng(65).standard_normal(N)
CHANCE = np.random.default_rng(66).random(N)
TOUCHES_S = (1.0, 2.2, 3.4, 4.6)


def felt(place, counts):
    """(onsets of contacts that are not late, [[row, col] named, ...]) of a fake skin
    with four touches and a taxel with some counts."""
    frames = np.zeros((N, 8, 8))
    for begin_s in TOUCHES_S:
        age_s = T - begin_s
        is_touched = (age_s >= 0.0) & (age_s < 0.6)
        frames[:, 2:4, 2:4] += (is_touched * (100 + 200 * age_s))[:, None, None]
    frames[:, *place] += counts
    recording = Recording(T, np.clip(frames, 0, 60000).astype(np.uint16))
    contacts = {}
    named = []
    skin, playback = play(skin_file(LAYOUT), recording)
    with skin:
        tracker = ContactTracker(LAYOUT, horizon_s=1.2)
        for frame in Loop(skin, lasts_s=playback.ends).frames():
            contacts |= dict.fromkeys(tracker.push(frame))
            named.append(skin.broken_changes())
    onsets = [round(contact.onset_s, 2) for contact in contacts if not contact.late]
    return onsets, [places for places in named if places is not None]


@pytest.mark.parametrize(
    "counts",
    [500 + 0 * NOISE, 5000 + 600 * NOISE, 500 * (CHANCE < 0.2)],
    ids=["stuck", "noisy", "flickers"],
)
def test_a_broken_taxel_is_named_and_hides_no_touch(counts):
    onsets, named = felt((7, 3), counts)
    assert set(TOUCHES_S) <= set(onsets)
    assert [[7, 3]] in named


def test_nothing_is_named_where_all_taxels_work():
    assert felt((5, 5), 0 * T) == (list(TOUCHES_S), [])


def broken_at(frames, *, shape=(8, 8), wraps=False, step_s=0.1):
    """When each taxel (row, col) is first broken, of frames {taxel: counts}."""
    taxels = LoneTaxels(*shape, wraps=wraps)
    valid = np.ones(shape, dtype=bool)
    at = {}
    for i, pressed in enumerate(frames):
        counts = np.zeros(shape, np.uint16)
        for place, count in pressed.items():
            counts[place] = count
        taxels.follow(counts, 40, valid, i * step_s)
        for place in map(tuple, np.argwhere(taxels.broken).tolist()):
            at.setdefault(place, i)
    return at


ALONE = {(3, 3): 41}


@pytest.mark.parametrize(
    ("frames", "broken"),
    [
        ([ALONE] * 6, {(3, 3): 5}),
        ([ALONE] * 5, {}),
        ([{(3, 3): 40}] * 90, {}),
        ([{}] * 2 + [ALONE] * 21, {(3, 3): 22}),
        ([{}] * 2 + [ALONE] * 20, {}),
        ([{}] * 2 + ([ALONE] + [{}] * 4) * 4 + [ALONE], {(3, 3): 22}),
        ([{}] * 2 + ([ALONE] + [{}] * 5) * 9, {}),
        ([{}] * 2 + ([ALONE] * 19 + [{(3, 3): 41, (4, 4): 41}]) * 3, {}),
    ],
)
def test_it_is_broken_after_half_a_second_from_the_start_and_two_seconds_later(
    frames, broken
):
    assert broken_at(frames) == broken


@pytest.mark.parametrize(
    ("shape", "place", "wraps", "broken"),
    [
        ((1, 5), (0, 2), False, False),
        ((2, 2), (0, 0), True, False),
        ((4, 6), (0, 0), False, False),
        ((4, 6), (0, 1), False, True),
        ((4, 6), (0, 0), True, True),
    ],
)
def test_a_taxel_with_fewer_than_five_neighbours_is_no_judge_of_itself(
    shape, place, wraps, broken
):
    """A pad of a glove is touched by one taxel alone."""
    frames = [{place: 500}] * 60
    assert (place in broken_at(frames, shape=shape, wraps=wraps)) == broken


def test_dead_neighbours_do_not_count():
    counts = np.zeros((3, 3), np.uint16)
    counts[1, 1] = 500
    for dead, broken in ((4, False), (3, True)):
        taxels = LoneTaxels(3, 3, wraps=False)
        valid = np.arange(9).reshape(3, 3) >= dead
        for i in range(6):
            taxels.follow(counts, 40, valid, i / 10)
        assert taxels.broken[1, 1] == broken


def test_it_is_trusted_again_after_half_a_second_of_silence():
    taxels = LoneTaxels(3, 3, wraps=False)
    valid = np.ones((3, 3), dtype=bool)
    states = []
    for i in range(14):
        counts = np.zeros((3, 3), np.uint16)
        counts[1, 1] = 500 * (i <= 6)
        taxels.follow(counts, 40, valid, i / 10)
        states.append(bool(taxels.broken[1, 1]))
    assert states == [False] * 5 + [True] * 6 + [False] * 3


def test_a_skin_without_a_threshold_judges_no_taxel():
    counts = np.zeros((300, 8, 8), np.uint16)
    counts[:, 4, 4] = 3
    recording = Recording(T[:300], counts)
    skin, _ = play(skin_file(replace(LAYOUT, threshold_counts=0)), recording)
    with skin:
        assert all(frame.valid.all() for frame in Loop(skin, lasts_s=3.0).frames())
