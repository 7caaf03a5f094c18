"""Sampling uniform in time, whatever the frames' times were."""

import math
import os
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from edge.errors import InputError
from edge.features.names import PAPER
from edge.features.vector import feature_vector, feature_vectors
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
    """What an arm does that bounces off a rigid object tells nothing of the object."""
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
    complete = feature_vector(series(t, peak, area, t), window_s)
    so_far = feature_vector(series(t[:n], peak[:n], area[:n], t[:n]), window_s)
    assert complete.tolist() == so_far.tolist()


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
    for motion, sampled in (
        ([0.0, np.nan, 0.2, np.nan], [0.0, 0.1, 0.2, 0.2]),
        ([np.nan] * 4, [0.0] * 4),
    ):
        felt = series([0.0, 0.4, 0.8, 1.2], [1] * 4, motion=motion)
        vector = feature_vector(felt, 1.2, samples=4)
        assert vector[8:] == pytest.approx(sampled)


@pytest.mark.parametrize("release_s", [0.05, 0.15, 60.0])
def test_windows_measured_together_have_the_bits_of_each_alone(release_s):
    """Also where the contact lifts off within one of them, is over in another and goes
    on in a later one, and where the first frames lack the pose."""
    t = np.arange(13) / 10.0
    peak = [300, 310, 320, 0, 330, 340, 350, 360, 0, 0, 0, 0, 0]
    area = [3 * (count > 0) for count in peak]
    motion = np.where(t < 0.2, np.nan, np.sqrt(t))
    felt = series(t, peak, area, motion)
    felt = replace(felt, layout=replace(felt.layout, release_s=release_s))
    names = [
        *PAPER,
        "log_max_force",
        "relative_max_force_rate@7",
        "max_force_deviation",
    ]
    names += ["contact_area_mean", "contact_motion_roughness"]
    windows = [0.1, 0.25, 0.3, 0.7, 0.9, 1.2]
    together = feature_vectors(felt, windows, 12, names)
    alone = [feature_vector(felt, window_s, 12, names) for window_s in windows]
    assert together.tobytes() == np.stack(alone).tobytes()


def pressed_vector(layout, taxels, features, samples, window_s=1.0):
    """The features (features, samples) of frames of these taxels, uniform in a
    second."""
    times = np.linspace(0.0, 1.0, len(taxels))
    frames = [pressed(layout, t, of) for t, of in zip(times, taxels, strict=True)]
    contact = followed(layout, frames, features=features)
    vector = feature_vector(contact.series(), window_s, samples, features)
    return vector.reshape(-1, samples).tolist()


FLAT = SkinLayout(5, 7, threshold_counts=10, onset_counts=10, counts_per_newton=100.0)


def test_a_contact_is_followed_across_the_seam_and_does_not_jump():
    taxels = [{(2, (5 + i) % 7): 50} for i in range(5)]
    around = pressed_vector(replace(FLAT, wraps=True), taxels, ["contact_around"], 5)
    assert around == [[5.0, 6.0, 7.0, 8.0, 9.0]]


def test_where_nothing_lies_the_place_is_that_of_the_frames_that_know_it():
    """The right half is touched in two frames of nine, and the contact ends."""
    right = [0, 0, 40, 80, 0, 0, 0, 0, 0]
    taxels = [
        {(1, 1): 60 if i < 4 else 0, (i % 4, 5): force} for i, force in enumerate(right)
    ]
    features = ["right_along", "right_force", "right_area"]
    assert pressed_vector(FLAT, taxels, features, 9) == [
        [2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0],
        [0.0, 0.0, 0.4, 0.8, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    ]
    assert pressed_vector(FLAT, taxels[:2], ["right_along"], 2) == [[0.0, 0.0]]


def test_a_rate_is_the_change_a_second_of_the_sampled_values():
    taxels = [{(1, 1): 100 + 20 * i} for i in range(11)]
    features = ["max_force", "max_force_rate", "contact_area_rate"]
    force, rate, area_rate = pressed_vector(FLAT, taxels, features, 5)
    assert force == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.0])
    assert rate == pytest.approx([2.0] * 5)
    assert area_rate == [0.0] * 5


def test_force_motion_follows_the_force_where_the_area_stays():
    taxels = [{(1, 1): 50, (1, 2): force} for force in (50, 150, 50)]
    features = ["contact_motion", "force_motion"]
    motion, of_force = pressed_vector(replace(FLAT, pitch_m=0.01), taxels, features, 3)
    assert motion == [0.0, 0.0, 0.0]
    assert of_force == pytest.approx([0.0, 0.0025, 0.0], abs=1e-17)


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ((0.0,), "window"),
        ((math.nan,), "window"),
        ((math.inf,), "window"),
        ((1.2, 1), "at least 2 samples"),
        ((1.2, 2, ["stiffness"]), "stiffness was not measured"),
        ((1.2, 2, ["skin_force"]), "skin_force was not measured"),
    ],
)
def test_what_makes_no_sense_or_was_not_measured_is_refused(arguments, word):
    with pytest.raises(InputError, match=word):
        feature_vector(series([0.0], [1]), *arguments)
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
from edge.features.names import PAPER
from edge.features.vector import feature_vector, feature_vectors
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
