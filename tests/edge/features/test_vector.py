"""Sampling uniform in time, whatever the frames' times were."""

import math
import os

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from edge.errors import InputError
from edge.features.vector import feature_vector
from edge.touch.arm import Chain
from edge.touch.contact import FeatureSeries
from edge.touch.layout import SkinLayout
from tests.conftest import python
from tests.edge.touch.pressed import followed, pressed


def series(t, peak, area=None, motion=None, scale=None, ended=False):
    n = len(t)
    return FeatureSeries(
        t=np.array(t, dtype=float),
        peak=np.array(peak, dtype=np.int64),
        area=np.array(area if area is not None else [1] * n, dtype=np.int64),
        sums=np.zeros((n, 2), dtype=np.int64),
        motion=np.array(motion if motion is not None else [0.0] * n),
        same=np.zeros(n, dtype=np.bool_),
        layout=SkinLayout(1, 1, counts_per_newton=scale),
        ended=ended,
    )


def test_a_short_lift_off_is_bridged():
    """What an arm does that bounces off a rigid thing tells nothing of the thing."""
    t = np.arange(130) / 100
    held = feature_vector(series(t, [100] * 130, [4] * 130, 0.1 * t), 1.2)
    for first, length in [(30, 29), (110, 20)]:
        away = np.arange(first, first + length)
        area = np.full(130, 4)
        peak = np.full(130, 100)
        area[away] = peak[away] = 0
        motion = 0.1 * t
        motion[away] = motion[first - 1]
        bridged = feature_vector(series(t, peak, area, motion), 1.2)
        assert bridged[:80].tolist() == held[:80].tolist()
        if first + length < 120:
            assert bridged == pytest.approx(held, abs=1e-15)


def test_a_contact_that_is_over_was_over_when_it_lifted_off():
    t = np.arange(130) / 100
    peak = np.full(130, 100)
    area = np.full(130, 4)
    peak[60:] = area[60:] = peak[58] = area[58] = 0  # it bounces just before
    vector = feature_vector(series(t, peak, area), 1.2)
    assert set(vector[:20]) == {100.0}
    assert set(vector[20:40]) == {0.0}
    assert set(vector[40:60]) == {4.0}
    assert set(vector[60:80]) == {0.0}


@given(seed=st.integers(0, 1000), window_s=st.floats(0.05, 1.2))
def test_nothing_after_the_window_changes_its_features(seed, window_s):
    """A board decides before it knows whether a contact that has lifted off comes
    back."""
    rng = np.random.default_rng(seed)
    t = np.arange(130) / 100
    area = np.repeat(rng.integers(0, 3, 13), 10)
    area[0] = 1
    peak = 100 * np.minimum(area, 1)
    n = int(np.searchsorted(t, window_s)) + 1
    whole = feature_vector(series(t, peak, area, t), window_s)
    so_far = feature_vector(series(t[:n], peak[:n], area[:n], t[:n]), window_s)
    assert whole.tolist() == so_far.tolist()


def test_forty_samples_of_each_feature_from_onset_to_the_end_of_the_window():
    t = np.linspace(0, 2, 201)
    vector = feature_vector(series(t, 1000 * t, 10 * t + 1, 0.1 * t, scale=500.0), 1.2)
    times = np.linspace(0, 1.2, 40)
    assert vector.shape == (120,)
    assert vector.dtype == np.float64
    force = np.floor(1000 * t) / 500.0
    assert vector[:40] == pytest.approx(np.interp(times, t, force), abs=1e-15)
    assert vector[40:80] == pytest.approx(
        np.interp(times, t, np.floor(10 * t + 1)), abs=1e-13
    )
    assert vector[80:] == pytest.approx(0.1 * times, abs=1e-16)


def test_times_that_stand_still_or_go_back_never_reach_the_samples():
    """Frames of one time, and taxels read earlier than in the frame before."""
    layout = SkinLayout(1, 2, threshold_counts=10, onset_counts=10, release_s=60.0)
    readings = [(0.0, 100), (0.25, 150), (0.125, 200), (0.5, 250), (0.5, 300)]
    frames = []
    latest_s = 0.0
    for t, peak in [*readings, (1.0, 400)]:
        latest_s = max(latest_s, t)
        times = np.full((1, 2), t)
        frames.append(pressed(layout, latest_s, {(0, 0): peak}, times=times))
    contact = followed(layout, frames)
    assert contact.series().t.tolist() == [0.0, 0.25, 0.5, 1.0]
    vector = feature_vector(contact.series(), 1.0, 5, ["max_force"])
    assert vector.tolist() == [100.0, 200.0, 300.0, 350.0, 400.0]


def test_motion_is_interpolated_over_frames_without_a_pose():
    motion = [0.0, np.nan, 0.2, np.nan]
    vector = feature_vector(
        series([0.0, 0.4, 0.8, 1.2], [1] * 4, motion=motion),
        1.2,
        samples=4,
    )
    assert vector[8:] == pytest.approx([0.0, 0.1, 0.2, 0.2])
    none = feature_vector(
        series([0.0, 1.2], [1, 1], motion=[np.nan] * 2),
        1.2,
        samples=4,
    )
    assert none[8:].tolist() == [0.0] * 4


@pytest.mark.parametrize("window", [0.0, float("nan"), float("inf")])
def test_a_window_that_makes_no_sense_is_refused(window):
    with pytest.raises(InputError, match="window"):
        feature_vector(series([0.0], [1]), window)


def test_too_few_samples_and_an_empty_series_are_refused():
    with pytest.raises(InputError, match="at least 2 samples"):
        feature_vector(series([0.0], [1]), 1.2, samples=1)
    with pytest.raises(InputError, match="no frame"):
        feature_vector(series([], []), 1.2)


def test_what_is_too_large_is_refused_and_not_taken_for_unknown():
    large = series([0.0, 0.5, 1.2], [10, 20, 30], scale=1e-308)
    assert not np.isfinite(feature_vector(large, 1.2)[:40]).any()


def test_the_logarithm_of_a_stiffness_that_no_frame_knows_is_0():
    """Without joint angles an arm's contact has no motion, and so no stiffness."""
    layout = SkinLayout(4, 4, threshold_counts=99)
    frames = [pressed(layout, i / 10, {(1, 1): 400}) for i in range(13)]
    for chain, expected in ((Chain.cody(), 0.0), (None, math.log((400 + 100) / 0.1))):
        contact = followed(layout, frames, features=["log_stiffness"], chain=chain)
        vector = feature_vector(contact.series(), 1.2, 5, ["log_stiffness"])
        assert vector.tolist() == [expected] * 5
        assert contact.missing_pose == (chain is not None)


BITS = """
import hashlib
import edge
from edge import demo
from edge.features.names import feature, measures
from edge.features.names import names as all_names
from edge.features.vector import feature_vector
from edge.touch.track import (ContactTracker, first_contact)

names = [n for n in all_names() if "kernels" not in n and "shear" not in n]
logs = [n for n in names if not feature(n).quantity.signed]
names += [f"log_{name}" for name in logs]
names += [f"sqrt_{name}_deviation" for name in logs]
for path in sorted(demo.FOLDER.glob("*.npz")):
    recording = edge.load(path)
    measured = measures(recording.layout, names, 5)
    chain = edge.Chain.cody()
    tracker = ContactTracker(recording.layout, chain=chain, measures=measured)
    _, series = first_contact(recording, tracker)
    vector = feature_vector(series, 1.2, features=names)
    print(hashlib.sha256(vector.tobytes()).hexdigest())
"""


def test_every_bit_of_a_vector_is_the_same_without_the_processors_newer_instructions():
    """numpy's own logarithm has other last bits there, and BLAS other sums."""
    newer = " ".join(np.show_config(mode="dicts")["SIMD Extensions"]["found"])
    older = {"NPY_DISABLE_CPU_FEATURES": newer, "OPENBLAS_CORETYPE": "Prescott"}
    with_all = python("-c", BITS).stdout.split()
    without = python("-c", BITS, env=os.environ | older).stdout.split()
    assert len(with_all) == 4
    assert without == with_all
