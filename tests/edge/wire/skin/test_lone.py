"""A broken taxel is told by its neighbours, named, and hides no touch."""

from dataclasses import replace

import numpy as np
import pytest

from edge.record.recording import Recording
from edge.touch.layout import SkinLayout
from edge.touch.track import ContactTracker
from edge.wire.fake.player import play, skin_file
from edge.wire.skin.lone import LoneTaxels
from edge.wire.skin.loop import Loop

LAYOUT = SkinLayout(8, 8, threshold_counts=40, onset_counts=60)
T = np.arange(560) / 100.0
DRAW = np.random.default_rng(65)
TOUCHES_S = [1.0, 2.2, 3.4, 4.6]


def felt(counts, layout=LAYOUT):
    """(onsets of contacts that are not late, [row, col] of the taxels named) of a fake
    skin with four touches, and with some counts of taxel (7, 3)."""
    frames = np.zeros((len(T), 8, 8))
    for begin_s in TOUCHES_S:
        frames[(begin_s <= T) & (begin_s + 0.6 > T), 2:4, 2:4] = 300
    frames[:, 7, 3] = counts
    contacts = {}
    named = []
    skin, _ = play(skin_file(layout), Recording(T, frames.astype(np.uint16)))
    tracker = ContactTracker(layout)
    with skin:
        for frame in Loop(skin, lasts_s=T[-1]).frames():
            contacts |= dict.fromkeys(tracker.push(frame))
            named += skin.broken_changes() or []
    return [round(c.onset_s, 2) for c in contacts if not c.late], named


@pytest.mark.parametrize(
    "counts",
    [500, DRAW.normal(5000, 600, len(T)), 500 * (DRAW.random(len(T)) < 0.2)],
    ids=["stuck", "noisy", "flickers"],
)
def test_a_broken_taxel_is_named_and_hides_no_touch(counts):
    onsets, named = felt(counts)
    assert set(TOUCHES_S) <= set(onsets)
    assert named == [[7, 3]]


def test_a_skin_without_a_broken_taxel_or_a_threshold_names_none():
    assert felt(0) == (TOUCHES_S, [])
    assert felt(3, replace(LAYOUT, threshold_counts=0))[1] == []


COUNTS = {".": (0, 0), "w": (40, 0), "A": (41, 0), "B": (41, 41)}
"""Counts of a taxel and of one beside it."""


def changes(states, shape=(8, 8), place=(3, 3), *, wraps=False, dead=0):
    """The frames, ten a second, after which a taxel begins or ceases to be broken."""
    taxels = LoneTaxels(*shape, wraps=wraps)
    valid = np.arange(shape[0] * shape[1]).reshape(shape) >= dead
    broken = [False]
    for i, state in enumerate(states):
        counts = np.zeros(shape, np.uint16)
        counts[place], counts[-1, place[1] - 1] = COUNTS[state]
        taxels.follow(counts, 40, valid, i / 10)
        broken.append(taxels.broken[place])
    return np.flatnonzero(np.diff(broken)).tolist()


@pytest.mark.parametrize(
    ("states", "frames"),
    [
        ("A" * 6, [5]),
        ("A" * 5, []),
        ("." + "A" * 6, [6]),
        ("w" * 90, []),
        (".." + "A" * 21, [22]),
        (".." + "A" * 20, []),
        (".." + "A...." * 4 + "A", [22]),
        (".." + "A....." * 9, []),
        (".." + ("A" * 19 + "B") * 3, []),
        ("A" * 7 + "B" + "." * 7, [5, 12]),
    ],
)
def test_it_is_alone_for_half_a_second_from_the_start_or_two_until_it_is_silent(
    states, frames
):
    assert changes(states, (4, 6), (3, 3)) == frames


@pytest.mark.parametrize(
    ("shape", "place", "more", "is_judged"),
    [
        ((1, 5), (0, 2), {}, False),
        ((2, 2), (0, 0), {"wraps": True}, False),
        ((4, 6), (0, 0), {}, False),
        ((4, 6), (0, 1), {}, True),
        ((4, 6), (0, 0), {"wraps": True}, True),
        ((3, 3), (1, 1), {"dead": 3}, True),
        ((3, 3), (1, 1), {"dead": 4}, False),
    ],
)
def test_it_has_five_living_neighbours_as_a_pad_of_a_glove_is_touched_alone(
    shape, place, more, is_judged
):
    assert bool(changes("A" * 6, shape, place, **more)) == is_judged


@pytest.mark.parametrize(("wraps", "frames"), [(True, []), (False, [5])])
def test_a_neighbour_beyond_the_seam_is_beside_it(wraps, frames):
    assert changes("B" * 6, (4, 6), (2, 0), wraps=wraps) == frames


def test_the_start_of_a_skin_is_its_first_frame_whatever_the_clock_says():
    taxels = LoneTaxels(8, 8, wraps=False)
    counts = np.zeros((8, 8), np.uint16)
    counts[3, 3] = 500
    broken = []
    for eighth in range(8):
        taxels.follow(counts, 40, counts < 501, 100.0 + eighth / 8)
        broken.append(taxels.broken[3, 3])
    assert broken == [False] * 4 + [True] * 4


@pytest.mark.parametrize(("columns", "is_broken"), [([7], True), ([0, 7], False)])
def test_the_last_column_of_a_skin_that_wraps_is_beside_the_first(columns, is_broken):
    taxels = LoneTaxels(8, 8, wraps=True)
    counts = np.zeros((8, 8), np.uint16)
    counts[3, columns] = 500
    for eighth in range(8):
        taxels.follow(counts, 40, counts < 501, eighth / 8)
    assert taxels.broken[3, 7] == is_broken
