"""Counts above a baseline that follows slow drift, bounded, in whole numbers."""

import numpy as np

from edge.wire.skin.decoder import HELD_S, SCALE_BITS, Baseline
from edge.wire.skin.file import Signal

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
