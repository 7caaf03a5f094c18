"""Named sets, transforms, summaries and features of cells and joints, against exact
values."""

import math
from itertools import pairwise

import numpy as np
import pytest

from edge.errors import InputError
from edge.features.names import feature
from edge.features.vector import FEATURES, feature_vector, widths
from edge.touch.layout import SkinLayout
from tests.edge.touch.pressed import followed, pressed
from train.data.feature_sets import SETS, expand, unit

SKIN = SkinLayout(
    4,
    6,
    threshold_counts=9,
    onset_counts=9,
    counts_per_newton=100.0,
    pitch_m=0.02,
    dead=(5,),
    release_s=0.25,
)


def series_of(frames, features, joints=0):
    return followed(SKIN, frames, features=features, joints=joints).series()


def touch(peaks, step=0.25, joints=None):
    """A touch of two taxels, one of them half as strong; shear grows with each
    frame."""
    joints = [None] * len(peaks) if joints is None else joints
    frames = []
    for i, (peak, angles) in enumerate(zip(peaks, joints, strict=True)):
        taxels = {(1, 1): peak, (1, 2): peak // 2}
        shear = np.full((*SKIN.shape, 2), 10 * i, dtype=np.int16)
        frames.append(pressed(SKIN, i * step, taxels, joints=angles, shear=shear))
    return frames


def vector_of(frames, *features, samples=5, window=1.0, **options):
    return feature_vector(
        series_of(frames, features, **options),
        window,
        samples,
        features,
    )


PEAKS = (100, 300, 200, 400, 400)


def test_every_set_has_features_that_exist_and_none_is_in_two_sets():
    members = [name for names in SETS.values() for name in names]
    assert len(members) == len(set(members))
    assert [feature(name).name for name in members] == members
    assert SETS["paper"] == FEATURES


def test_units_are_those_of_the_skin():
    metric = SkinLayout(rows=6, cols=8, counts_per_newton=100.0, pitch_m=0.01)
    units = {
        "max_force": "newton",
        "left_force_rate": "newton/s",
        "skin_slant": "taxel^2",
        "force_motion": "metre",
        "skin_pressure": "newton/taxel",
        "stiffness": "newton/metre",
        "log_stiffness": "log(newton/metre)",
        "sqrt_relative_taxel_force_rate": "sqrt(1)/s",
        "log_skin_force_mean": "log(newton)",
        "joint_change_rate@10": "radian/s",
        "sqrt_taxel_shear": "sqrt(newton)",
        "contact_shear_ratio_rate": "1/s",
        "log_skin_shear_size": "log(newton)",
    }
    assert {name: unit(feature(name), metric) for name in units} == units
    assert unit(feature("skin_force"), SkinLayout(rows=6, cols=8)) == "count"


def test_sets_and_features_expand_to_features_in_their_order_each_once():
    names = ["contact_area", "paper", "skin_force"]
    assert expand(names) == (
        "contact_area",
        "max_force",
        "contact_motion",
        "skin_force",
    )


@pytest.mark.parametrize("name", [name for name in SETS if "kernels" not in name])
@pytest.mark.parametrize("samples", [2, 40])
def test_a_vector_has_the_widths_that_are_told(name, samples):
    features = SETS[name]
    frames = touch(PEAKS, joints=np.zeros((5, 3)))
    vector = vector_of(frames, *features, samples=samples, joints=3)
    column_counts = widths(features, samples, SKIN, joints=3)
    assert len(column_counts) == len(features)
    assert len(vector) == sum(column_counts)
    assert np.isfinite(vector).all()


def test_a_name_says_its_own_number_of_times():
    vector = vector_of(
        touch(PEAKS),
        "max_force@3",
        "max_force",
        "taxel_force_mean@2",
        samples=5,
    )
    assert vector[:3].tolist() == [1.0, 2.0, 4.0]
    assert vector[3:8].tolist() == [p / 100 for p in PEAKS]
    assert vector[8 + 6] == (1.0 + 4.0) / 2
    assert vector_of(touch(PEAKS), "max_force_rate@3").tolist() == [2.0, 3.0, 4.0]


def test_the_transform_next_to_the_name_is_the_first():
    peak = np.array(PEAKS) / 100.0
    first_root = vector_of(touch(PEAKS), "relative_sqrt_max_force")
    assert first_root == pytest.approx(np.sqrt(peak) / 2.0, rel=1e-15)
    first_part = vector_of(touch(PEAKS), "log_relative_max_force")
    assert first_part == pytest.approx(np.log(peak / 4.0 + 1.0), rel=1e-15)


def test_a_square_root_keeps_the_sign():
    frames = [pressed(SKIN, t, {(0, 2): 50, (1, 1): 50, (2, 0): 50}) for t in (0, 1)]
    slant = vector_of(frames, "skin_slant")
    assert (slant < 0.0).all()
    assert vector_of(frames, "sqrt_skin_slant") == pytest.approx(-np.sqrt(-slant))


def test_summaries_are_one_number_of_the_transformed_samples():
    roots = [math.sqrt(p / 100) for p in PEAKS]
    mean = math.fsum(roots) / 5
    deviation = math.sqrt(math.fsum((r - mean) ** 2 for r in roots) / 5)
    steps = [abs(b - a) for a, b in pairwise(roots)]
    vector = vector_of(
        touch(PEAKS),
        "sqrt_max_force_mean",
        "sqrt_max_force_deviation",
        "sqrt_max_force_roughness",
    )
    assert vector == pytest.approx(
        [mean, deviation, math.fsum(steps) / 4],
        rel=4e-16,
        abs=1e-15,
    )


def test_the_floor_of_a_logarithm_is_the_least_that_is_in_contact():
    frames = touch([100, 100, 0, 0, 0])
    vector = vector_of(
        frames,
        "log_max_force",
        "log_contact_area",
        "log_force_motion",
        "log_taxel_force_mean",
    )
    assert vector[4] == math.log(0.1)  # a threshold of 9 counts, 100 counts a newton
    assert vector[9] == math.log(1.0)
    assert vector[14] == pytest.approx(math.log(0.002))  # a tenth of 20 mm
    assert vector[15] == pytest.approx(math.log(0.1))  # a taxel that was never touched
    assert vector[0] == math.log(1.0 + 0.1)


def test_pressure_is_force_over_area_and_stiffness_force_over_motion():
    frames = touch([100, 100, 100])
    frames[1].counts[1, 3] = 200
    frames[2].counts[:] = 0
    pressure = vector_of(
        frames,
        "skin_pressure",
        "left_pressure",
        window=0.5,
        samples=3,
    )
    assert pressure == pytest.approx([0.75, 3.5 / 3, 0.0, 0.75, 0.75, 0.0])
    features = ["stiffness", "skin_force", "force_motion"]
    stiffness, force, motion = vector_of(
        frames,
        *features,
        window=0.5,
        samples=3,
    ).reshape(3, 3)
    assert stiffness[:2] == pytest.approx((force[:2] + 0.1) / (motion[:2] + 0.002))
    assert stiffness[0] == pytest.approx(1.6 / 0.002)


def test_cells_follow_in_their_places_and_have_one_largest_value():
    vector = vector_of(touch(PEAKS), "relative_taxel_force", samples=5).reshape(23, 5)
    # Row 1, column 1 is cell 6, as the cell before it is dead.
    assert vector[6].tolist() == [0.25, 0.75, 0.5, 1.0, 1.0]
    assert vector[7].tolist() == [0.125, 0.375, 0.25, 0.5, 0.5]
    assert np.count_nonzero(vector.any(axis=1)) == 2


def test_joints_are_taken_as_they_change_from_onset_on_and_as_they_are():
    angles = np.array([[1.0, -2.0], [1.5, -2.0], [2.0, -2.5], [2.0, -3.0], [2.0, -3.0]])
    vector = vector_of(
        touch(PEAKS, joints=angles),
        "joint_change",
        "joint_angle",
        "joint_change_rate",
        joints=2,
    )
    change, angle, rate = vector.reshape(3, 2, 5)
    assert change.tolist() == (angles - angles[0]).T.tolist()
    assert angle.tolist() == angles.T.tolist()
    assert rate.tolist() == np.gradient(angles.T, 0.25, axis=1).tolist()


def test_angles_that_lack_are_interpolated_and_flagged():
    angles = [np.array([1.0]), None, np.array([2.0]), None, np.array([3.0])]
    contact = followed(
        SKIN,
        touch(PEAKS, joints=angles),
        features=["joint_angle"],
        joints=1,
    )
    assert contact.missing_pose
    vector = feature_vector(contact.series(), 1.0, 5, ["joint_angle"])
    assert vector.tolist() == [1.0, 1.5, 2.0, 2.5, 3.0]
    never = series_of(touch(PEAKS), ["joint_change"], joints=1)
    assert feature_vector(never, 1.0, 5, ["joint_change"]).tolist() == [0.0] * 5


@pytest.mark.parametrize(
    ("angle", "joints", "sentence"),
    [
        (0.0, 3, "has 2 joint angles, the features were measured with 3"),
        (np.inf, 2, "angle 1 of a frame's joints is not finite"),
    ],
)
def test_angles_that_do_not_suit_are_one_sentence(angle, joints, sentence):
    angles = np.zeros((5, 2))
    angles[3, 1] = angle
    with pytest.raises(InputError, match=sentence):
        series_of(touch(PEAKS, joints=angles), ["joint_change"], joints=joints)
