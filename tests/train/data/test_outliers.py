"""Recordings far outside all others are named, with what tells them."""

from dataclasses import replace
from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest

from train.data.outliers import (
    FEWEST_TRIALS,
    by_features,
    by_joints,
    deviations,
    nearly_constant,
)


def exact(values):
    """The distance of each row to the mean of the others, in their deviations, by
    fractions."""
    rows = np.array([[Fraction(x) for x in row] for row in values])
    distances = []
    for i, row in enumerate(rows):
        rest = np.delete(rows, i, axis=0)
        mean = rest.mean(axis=0)
        variance = ((rest - mean) ** 2).mean()
        distances.append(float(abs(row - mean).max()) / float(variance) ** 0.5)
    return distances


def test_distances_are_in_deviations_of_the_other_rows():
    rows = np.random.default_rng(0).normal(size=(12, 3))
    rows[4, 1] = 1e12
    rows += 1e3
    np.testing.assert_allclose(deviations(rows), exact(rows.tolist()), rtol=1e-12)


@pytest.mark.parametrize("usual", [0.0, 1.05])
def test_a_feature_that_hardly_varies_tells_of_no_outlier(usual):
    """Thirty trials whose values differ by a hundredth of the usual one."""
    values = np.full((31, 2), usual)
    values += 0.01 * usual * np.random.default_rng(0).normal(size=values.shape)
    values[3] += 0.4
    assert nearly_constant(values)
    assert not nearly_constant(np.random.default_rng(0).normal(size=(31, 2)))


def test_a_trial_that_a_feature_puts_far_outside_is_named(fitted):
    dataset = fitted.measured.of(["max_force"])
    X = dataset.features(fitted.window_s, fitted.samples)
    widths = dataset.widths(fitted.samples)
    assert list(by_features(dataset, X, widths)) == []
    X[5] *= 400.0
    (line,) = by_features(dataset, X, widths)
    assert f"{dataset.trials[5].path}: its max_force lies " in line
    X[:] = X[0]
    X[5] *= 400.0
    assert list(by_features(dataset, X, widths)) == []


def test_few_trials_do_not_tell_what_is_usual(fitted):
    few = fitted.measured.of(["max_force"]).part(np.arange(fitted.X.shape[0]) < 5)
    X = few.features(fitted.window_s, fitted.samples)
    X[2] *= 1e6
    assert len(X) < FEWEST_TRIALS
    assert list(by_features(few, X, few.widths(fitted.samples))) == []


def with_angle(dataset, angle, limits):
    """The trials with one angle at frame 7 of the second, and other limits."""
    trials = list(dataset.trials)
    joints = trials[1].recording.joints.copy()
    joints[7, 2] = angle
    recording = replace(trials[1].recording, joints=joints)
    trials[1] = replace(trials[1], recording=recording)
    names = dataset.chain.names
    chain = SimpleNamespace(names=names, limits=(limits,) * len(names))
    return replace(dataset, trials=tuple(trials), chain=chain)


def test_a_joint_beyond_its_limits_is_named(fitted):
    (line,) = by_joints(with_angle(fitted.measured, 3.5, (-3.2, 3.2)))
    assert "at frame 7 joint upper_arm_roll is at 3.5, beyond its limits" in line


def test_angles_without_limits_are_not_named(fitted):
    assert list(by_joints(with_angle(fitted.measured, 9.0, None))) == []
