"""The window as part of the choice."""

from dataclasses import replace

import numpy as np
import pytest

import train
from edge.recording import save

FEW = {"features": ["max_force"], "projection": "pca", "scaling": "none", "k": 1, "jobs": 1}


def touches(make_touch, folder, seconds, late_s):
    """Touches of two kinds that differ from `late_s` after onset on."""
    for seed in range(20):
        one = make_touch(seed=seed, seconds=seconds, arm=False, rate=25.0)
        frames = np.minimum(one.frames, 700)
        frames[one.t > 0.2 + late_s] //= 1 + seed % 2
        meta = {**one.meta, "labels": {"kind": "ab"[seed % 2]}}
        save(folder / f"{seed}.npz", replace(one, frames=frames, meta=meta))
    return str(folder)


def test_the_window_is_the_shortest_that_tells_what_longer_ones_do(make_touch, tmp_path):
    late = touches(make_touch, tmp_path / "late", 6.0, 1.8)
    fitted = train.fit(late, **FEW)
    assert fitted.window_s == 2.4
    assert fitted.chosen["kind"].accuracy.accuracy == 1.0
    (note,) = [note for note in fitted.notes if "the window is" in note]
    assert "2.4 s of touches that go on for longer" in note
    assert "100% at 2.4 s, 100% at 4.8 s" in note
    early = train.fit(touches(make_touch, tmp_path / "early", 6.0, 0.4), **FEW)
    assert early.window_s == 1.2


@pytest.mark.parametrize("given", [{"window_s": 1.2}, {"decision_points_s": (0.6, 1.2)}])
def test_a_window_that_is_given_is_kept(given, make_touch, tmp_path):
    fitted = train.fit(touches(make_touch, tmp_path, 4.0, 1.8), **FEW, **given)
    assert fitted.window_s == 1.2
    assert not any("the window is" in note for note in fitted.notes)


def test_touches_that_last_little_longer_than_the_window_are_told_in_it(make_touch, tmp_path):
    assert train.fit(touches(make_touch, tmp_path, 3.0, 1.8), **FEW).window_s == 1.2


def test_decision_points_of_a_long_window_are_as_many_as_of_the_usual_one(make_touch, tmp_path):
    fitted = train.fit(touches(make_touch, tmp_path, 6.0, 1.8), **FEW)
    assert fitted.sequential is not None
    points = fitted.sequential.decision_points_s
    assert points[-1] == 2.4
    assert len(points) <= 12
