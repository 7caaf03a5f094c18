"""Taxels that look broken in a whole set are named, with the option that leaves them
out."""

from dataclasses import replace

import numpy as np
import pytest

from edge.saving import save
from tests.conftest import FOREARM, touch
from train.choose.options import FitOptions
from train.data.broken import BrokenTaxels
from train.fitting import load

STUCK = (0, 5)


def with_taxel(recording, counts):
    """A recording in which a taxel that no touch reaches has other counts."""
    frames = recording.frames.copy()
    frames[:, *STUCK] = counts
    return replace(recording, frames=frames)


def named(recordings, layout=FOREARM):
    taxels = BrokenTaxels()
    for recording in recordings:
        taxels.add(recording)
    return taxels.places(layout)


TOUCHES = [touch(seed=seed) for seed in range(3)]
N = len(TOUCHES[0].t)


@pytest.mark.parametrize(
    ("counts", "places"),
    [
        (1, [STUCK]),
        (0, []),
        (101 + np.arange(N), [STUCK]),
        (100 + np.arange(N), []),
    ],
)
def test_a_taxel_is_named_that_is_constant_or_above_the_threshold(counts, places):
    assert named([with_taxel(recording, counts) for recording in TOUCHES]) == places


def test_it_must_be_so_in_every_recording_and_in_three():
    stuck = [with_taxel(recording, 500) for recording in TOUCHES]
    assert named(stuck[:2]) == []
    assert named([*stuck, TOUCHES[0]]) == []
    layout = replace(FOREARM, dead=(STUCK[1],))
    assert named(stuck, layout) == []
    valid = np.ones(FOREARM.shape, bool)
    valid[STUCK] = False
    assert named([replace(recording, valid=valid) for recording in stuck]) == []


def test_a_skin_that_is_held_throughout_is_not_broken():
    held = [replace(r, frames=np.full_like(r.frames, 500)) for r in TOUCHES]
    assert named(held) == []


def test_export_names_it_and_measures_the_touches_without_it_where_it_is_told_to(
    tmp_path,
):
    for i, recording in enumerate(TOUCHES):
        save(tmp_path / "works" / f"{i}.npz", recording)
        save(tmp_path / "stuck" / f"{i}.npz", with_taxel(recording, 60000))
    fixed = {"features": ["max_force"], "quick": True, "threshold": 100}
    works = load([tmp_path / "works"], FitOptions(**fixed))
    stuck = load([tmp_path / "stuck"], FitOptions(**fixed))
    without = load([tmp_path / "stuck"], FitOptions(**fixed, dead=[STUCK]))
    assert [note for note in stuck.notes if "[0, 5]" in note and "--dead 0,5" in note]
    assert not [note for note in without.notes if "--dead" in note]
    assert without.dataset.layout.dead == (STUCK[1],)
    peaks, others = (
        [trial.series.peak.tolist() for trial in loaded.dataset.trials]
        for loaded in (works, without)
    )
    assert peaks == others
