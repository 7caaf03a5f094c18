"""Scaling, projection and leave-one-out with other features than the paper's three."""

import numpy as np
import pytest

from edge.errors import InputError
from train.dataset import load_trials
from train.scaling import scale_of

SIX = ("skin_force", "contact_motion", "left_length", "max_force", "skin_area", "contact_area")


def vectors(features: int, samples: int, n: int = 30, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    scale = 10.0 ** rng.integers(-3, 4, features)
    walks = rng.normal(size=(n, features, samples)).cumsum(axis=2)
    return np.abs(walks * scale[:, None]).reshape(n, -1)


def test_method_v_brings_motion_to_the_range_of_force_and_area_wherever_it_stands():
    X = vectors(6, 4)
    blocks = X.reshape(30, 6, 4)
    largest = blocks.max(axis=(0, 2))
    gain = scale_of(X, "V", SIX)
    assert np.delete(gain, 1).tolist() == [1.0] * 5
    assert gain[1] * largest[1] == pytest.approx(max(largest[3], largest[5]))


@pytest.mark.parametrize("names", [("skin_force", "skin_area"), ("contact_motion", "skin_area")])
def test_method_v_without_the_papers_features_is_no_scaling(names):
    assert scale_of(vectors(2, 4), "V", names).tolist() == [1.0, 1.0]


def test_columns_that_are_no_whole_number_of_samples_are_refused():
    with pytest.raises(InputError, match="10 columns are no whole number of samples of 3"):
        scale_of(np.zeros((2, 10)), "IV")


def test_joint_angles_are_called_for_by_motion_alone(recordings):
    assert load_trials([recordings]).chain is not None
    assert load_trials([recordings], features=["force_motion"]).chain is not None
    assert load_trials([recordings], features=["max_force", "skin_force"]).chain is None
