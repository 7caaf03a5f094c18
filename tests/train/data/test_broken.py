"""Taxels that look broken in a whole set are named, with the option that leaves them
out."""

from dataclasses import replace

import numpy as np
import pytest

from edge.record.saving import save
from tests.conftest import FOREARM, touch
from train.choose.options import FitOptions
from train.data.broken import BrokenTaxels
from train.fitting import load

STUCK = (0, 5)
TOUCHES = [touch(seed=seed) for seed in range(3)]
RISING = np.arange(len(TOUCHES[0].t))


def with_taxel(counts, where=STUCK):
    """The touches, with other counts of a taxel that none of them reaches."""
    touches = [replace(one, frames=one.frames.copy()) for one in TOUCHES]
    for one in touches:
        one.frames[:, *where] = counts
    return touches


def named(recordings, layout=FOREARM):
    taxels = BrokenTaxels()
    for recording in recordings:
        taxels.add(recording)
    return taxels.places(layout)


@pytest.mark.parametrize(
    ("counts", "places"),
    [(1, [STUCK]), (0, []), (101 + RISING, [STUCK]), (100 + RISING, [])],
)
def test_a_taxel_is_named_that_is_constant_or_above_the_threshold(counts, places):
    assert named(with_taxel(counts)) == places


def test_it_must_be_so_in_every_recording_and_in_three_and_not_be_left_out():
    stuck = with_taxel(500)
    valid = np.ones(FOREARM.shape, bool)
    valid[STUCK] = False
    assert named(stuck[:2]) == []
    assert named([*stuck, TOUCHES[0]]) == []
    assert named([replace(one, valid=valid) for one in stuck]) == []
    assert named(stuck, replace(FOREARM, dead=(STUCK[1],))) == []


def test_a_skin_that_is_held_throughout_is_not_broken():
    assert named(with_taxel(500, (...,))) == []


def test_export_names_it_and_measures_the_touches_without_it_where_it_is_told_to(
    tmp_path,
):
    for i, recording in enumerate(with_taxel(60000)):
        save(tmp_path / f"{i}.npz", recording)
    fixed = {"features": ["max_force"], "quick": True, "threshold": 100}
    named, without = (
        load([tmp_path], FitOptions(**fixed, dead=dead)) for dead in ([], [STUCK])
    )
    assert "[0, 5]; `edge-classify export --dead 0,5`" in "".join(named.notes)
    assert "--dead" not in "".join(without.notes)
    trials = without.dataset.trials
    assert [trial.onset_s for trial in trials] == [0.2] * 3
    assert all(trial.series.peak.max() < 60000 for trial in trials)
