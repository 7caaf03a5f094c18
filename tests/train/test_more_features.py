"""Scaling, projection and leave-one-out with other features than the paper's three."""

import numpy as np
import pytest

from edge.errors import InputError
from train.dataset import load_trials
from train.pipeline import Choice, ContactClassifier
from train.projection import Projection
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
    _, gain = scale_of(X, "V", SIX)
    assert np.delete(gain, 1).tolist() == [1.0] * 5
    assert gain[1] * largest[1] == pytest.approx(max(largest[3], largest[5]))


@pytest.mark.parametrize("names", [("skin_force", "skin_area"), ("contact_motion", "skin_area")])
def test_method_v_without_the_papers_features_is_no_scaling(names):
    assert scale_of(vectors(2, 4), "V", names)[1].tolist() == [1.0, 1.0]


def test_method_iv_standardises_each_of_many_types():
    offset, gain = scale_of(vectors(6, 8), "IV", SIX)
    X = (vectors(6, 8).reshape(30, 6, 8) - offset[:, None]) * gain[:, None]
    assert X.mean(axis=(0, 2)) == pytest.approx(np.zeros(6), abs=1e-14)
    assert X.std(axis=(0, 2)) == pytest.approx(np.ones(6))


def test_columns_that_are_no_whole_number_of_samples_are_refused():
    with pytest.raises(InputError, match="10 columns are no whole number of samples of 3"):
        scale_of(np.zeros((2, 10)), "IV")


@pytest.mark.parametrize("samples", [20, 40, 160, 682])
def test_a_projection_of_many_columns_adds_up_exactly(samples):
    """Any order of the columns gives the same bits, and a training row lies at distance 0."""
    X = vectors(6, samples)
    projection = Projection("IV", 8, SIX).fit(X)
    rows = projection.transform(X)
    assert (projection.transform(X[3:4]) == rows[3]).all()
    rng = np.random.default_rng(1)
    shuffled = Projection("IV", 8, SIX).fit(X)
    order = rng.permutation(X.shape[1])
    shuffled.mean_, shuffled.gain_ = projection.mean_[order], projection.gain_[order]
    shuffled.weights_ = projection.weights_[order]
    assert (shuffled.transform(X[:, order]) == rows).all()


def test_a_classifier_of_six_features_and_few_samples(recordings):
    dataset = load_trials([recordings], features=SIX)
    X = dataset.features(1.0, 20)
    y = {"object": dataset.labels("object")}
    assert X.shape == (16, 120)
    assert (dataset.features(1.0, 20, names=SIX[2:4]) == X[:, 40:80]).all()
    fitted = ContactClassifier({"object": Choice("IV", 3, 1)}, SIX).fit(X, y)
    assert (fitted.predict(X)["object"] == y["object"]).all()


def test_joint_angles_are_called_for_by_motion_alone(recordings):
    assert load_trials([recordings]).chain is not None
    assert load_trials([recordings], features=["force_motion"]).chain is not None
    assert load_trials([recordings], features=["max_force", "skin_force"]).chain is None
