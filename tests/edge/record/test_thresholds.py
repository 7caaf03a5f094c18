"""Thresholds for a recording's own noise, and doubts about those that it has."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from edge.record.saving import save
from edge.record.thresholds import above, noise

QUIET = np.full((16, 24), 20, np.uint16)


def test_the_noise_is_the_largest_count_of_a_tenth_of_a_second():
    frames = np.arange(30, dtype=np.uint16).reshape(30, 1, 1)
    assert noise(np.arange(30) / 100.0, frames) == 9
    assert noise(np.arange(30) / 5.0, frames) == 0


def test_the_threshold_is_twice_the_noise_and_the_onset_half_as_much_again():
    assert above(20.0) == (40, 60)
    assert above(0.0) == (1, 2)
    assert above(40000.0) == (65534, 65534)


@pytest.mark.parametrize(
    ("skin", "warning"),
    [
        (
            {},
            "no threshold_counts, so any count above 0 is a contact; threshold_counts "
            "= 40 "
            "and onset_counts = 60 would do",
        ),
        (
            {"threshold_counts": 5},
            "first frame is above the onset of 5 counts, so its onset is not "
            "known; threshold_counts = 40",
        ),
        ({"threshold_counts": 40}, None),
    ],
)
def test_saving_warns_of_thresholds_and_names_better_ones(
    skin,
    warning,
    make_touch,
    tmp_path,
    caplog,
):
    touch = make_touch()
    frames = np.maximum(touch.frames, QUIET)
    meta = {**touch.meta, "skin": {"rows": 16, "cols": 24, **skin}}
    with caplog.at_level(logging.WARNING):
        save(tmp_path / "a.npz", replace(touch, frames=frames, meta=meta))
    assert (warning in caplog.text) if warning else not caplog.records


def test_a_touch_that_only_falls_from_its_start_has_no_better_threshold(
    make_touch,
    tmp_path,
    caplog,
):
    touch = make_touch(lead_s=0.0)
    save(tmp_path / "a.npz", replace(touch, frames=touch.frames[::-1]))
    assert "its onset is not known; record from before the touch" in caplog.text
