"""The outlier score: a score in whole numbers, and limits that held-out trials set."""

import math

import numpy as np
import pytest
from scipy.linalg import eigh

import train.data.vectors
from train.data.folds import stratified_folds
from train.data.vectors import Vectors
from train.model import outlier_score
from train.model.limits import LEAST, limits_of
from train.model.outlier_score import (
    CLIP,
    FARTHEST,
    MOST_COMPONENTS,
    STEP_BITS,
    OutlierSpace,
    held_out_scores,
    least_deviations,
)

WIDTHS = (20, 10)


def trials(n, seed=0, points=2):
    """Vectors (points, n, 30) around the means of four labels, and the labels."""
    rng = np.random.default_rng(seed)
    labels = np.array(list("abcd"))[np.arange(n) % 4]
    mixing = np.random.default_rng(1).normal(size=(6, 30))
    hidden = rng.normal(size=(points, n, 6)) + 5.0 * (np.arange(n) % 4)[:, None]
    X = hidden @ mixing + 0.1 * rng.normal(size=(points, n, 30))
    return X * np.repeat([1.0, 1e-4], WIDTHS), labels


def test_no_whole_number_reaches_2_to_the_53():
    X, labels = trials(200)
    space = OutlierSpace.of(X, labels, WIDTHS)
    columns, components = space.weights.shape
    most = CLIP * 2.0**STEP_BITS
    assert columns * most**2 < 2.0**53
    assert (np.abs(space.weights).sum(axis=0) * most).max() < 2.0**53
    for point in space.points:
        # Components are no longer than the steps, but for the rounding of the weights.
        longest = 1.01 * most * math.sqrt(columns)
        assert (np.linalg.norm(point.whitening, axis=0) * longest).max() < 2.0**53
        lengths = components * FARTHEST**2 + np.abs(point.rows).max() ** 2 * components
        assert 2.0 * lengths < 2.0**53
        # In the distance to known objects they are sixteenths.
        lengths = (point.weights**2).sum() * FARTHEST**2
        assert 2.0 * lengths * 16.0 < 2.0**53


def test_what_is_stored_fits_16_bits():
    X, labels = trials(60)
    X[0, 0] *= 1000.0
    space = OutlierSpace.of(X, labels, WIDTHS)
    assert 2**13 < np.abs(space.weights).max() < 2**15
    for point in space.points:
        assert 2**12 < np.abs(point.rows).max() < 2**14


def flagged(kind, new):
    """The shares of usual contacts, and of changed ones (2, m, 30), that lie beyond
    the limit of a score."""
    X, labels = trials(120)
    space = OutlierSpace.of(X, labels, WIDTHS)
    held_out = held_out_scores(X, labels, stratified_folds(labels), WIDTHS)
    _, limits = limits_of(getattr(held_out, kind), 0.02)
    usual, _ = trials(200, seed=9)
    return [
        float(np.mean(getattr(space.scores(x), kind)[0] > limits[0]))
        for x in (usual, new)
    ]


def test_a_shift_that_no_label_explains_is_an_outlier():
    new, _ = trials(200, seed=9)
    new[0, :, :5] += 1.0
    usual, shifted = flagged("outlier_score", new)
    assert usual <= 0.06
    assert shifted > 0.9


def test_an_object_between_the_labels_is_far_from_known_ones():
    """By what tells them apart."""
    new, _ = trials(200, seed=9)
    between = 0.5 * (new[:, 0::4] + new[:, 2::4])
    usual, remote = flagged("known_distance", between)
    assert usual <= 0.06
    assert remote > 3.0 * flagged("outlier_score", between)[1]


def test_discriminants_come_first_and_count_whole():
    X, labels = trials(60)
    point = OutlierSpace.of(X, labels, WIDTHS).points[0]
    assert point.weights.tolist() == [1.0] * 3 + [0.25] * 12
    means = np.stack([point.rows[labels == name].mean(axis=0) for name in "abcd"])
    spread = np.abs(means - means.mean(axis=0)).max(axis=0)
    assert spread[3:].max() < 0.01 * spread[0]


def test_where_a_label_is_dense_a_contact_is_sooner_an_outlier_and_unknown():
    X, labels = trials(60)
    X[:, labels == "a"] = X[:, :1] + 0.1 * (X[:, labels == "a"] - X[:, :1])
    point = OutlierSpace.of(X, labels, WIDTHS).points[0]
    for nearness in (point.nearness, point.weighted_nearness):
        assert nearness[labels == "a"].min() > 2.0 * np.median(nearness[labels != "a"])


def test_units_of_a_feature_do_not_matter():
    X, labels = trials(60)
    new, _ = trials(30, seed=3)
    scores = OutlierSpace.of(X, labels, WIDTHS).scores(new).outlier_score
    size = np.repeat([1.0, 2.0**40], WIDTHS)
    scaled = OutlierSpace.of(X * size, labels, WIDTHS).scores(new * size).outlier_score
    assert scaled == pytest.approx(scores, rel=1e-3)


def test_a_column_that_never_changed_counts_little_and_a_feature_not_at_all():
    X, labels = trials(60)
    X[..., 3] = 7.0
    X[..., 20:] = 0.25
    space = OutlierSpace.of(X, labels, WIDTHS)
    assert 0.0 < space.points[0].gain[3] < np.inf
    assert (space.points[0].gain[20:] == 0.0).all()


def test_of_a_drawn_scene_joints_count_by_how_far_those_that_move_have_moved():
    rng = np.random.default_rng(3)
    ways = rng.normal(size=(1, 40, 3)) * [1.0, 0.3, 0.01]
    all_time_series = ways[..., None] * np.linspace(0.1, 1.0, 10)
    X = np.concatenate(
        [rng.normal(size=(1, 40, 5)), all_time_series.reshape(1, 40, 30)], -1
    )
    names = ("log_max_force@5", "joint_change@10")
    least = least_deviations(Vectors(X, {}, names, (5, 30)), drawn=True)
    assert np.flatnonzero(least == 0.0).tolist() == [0, 1, 2, 3, 4, 14, 24]
    labels = np.array(list("ab"))[np.arange(40) % 2]
    space = OutlierSpace.of(X, labels, (5, 30), least)
    moved = X.copy()
    moved[..., 25:] += 1.0
    assert (
        space.scores(moved).outlier_score.tolist()
        == space.scores(X).outlier_score.tolist()
    )
    moved[..., 14] += 5.0
    assert (
        space.scores(moved).outlier_score > space.scores(X).outlier_score
    ).mean() > 0.9


def test_an_angle_may_lie_off_by_a_remount():
    vectors = Vectors(
        np.zeros((1, 2, 30)), {}, ("contact_motion@20", "joint_angle@10"), WIDTHS
    )
    least = least_deviations(vectors, drawn=False)
    assert not least[:20].any()
    assert set(least[20:]) == {math.radians(2.0)}


def test_held_out_scores_do_not_depend_on_the_held_out_trials():
    X, labels = trials(40)
    folds = stratified_folds(labels, 5)
    scores = held_out_scores(X, labels, folds, WIDTHS)
    training = folds != 2
    alone = OutlierSpace.of(X[:, training], labels[training], WIDTHS)
    expected = alone.scores(X[:, ~training])
    assert (
        scores.part(~training).outlier_score.tolist() == expected.outlier_score.tolist()
    )
    assert (
        scores.part(~training).known_distance.tolist()
        == expected.known_distance.tolist()
    )


def test_a_new_score_of_any_small_set_lies_beyond_its_limit_as_often_as_asked():
    """Without what few scores leave open, it would be a fifth more."""
    scores = np.exp(np.random.default_rng(0).exponential(size=(4000, 100)))
    _, limits = limits_of(scores, 0.02)
    beyond = np.exp(-np.log(limits)).mean()
    assert beyond == pytest.approx(0.02, abs=0.001)


def test_where_all_trials_are_copies_anything_else_is_beyond_the_limit():
    typical, limits = limits_of(np.zeros((1, 40)), 0.02)
    assert typical == limits == (pytest.approx(LEAST),)


def test_the_space_of_some_trials_is_as_if_there_were_no_others(monkeypatch):
    X, labels = trials(120)
    some = np.arange(120) % 5 != 1
    alone = OutlierSpace.of(X[:, some], labels[some], WIDTHS).scores(X)
    monkeypatch.setattr(train.data.vectors, "BLOCK", 200)
    among_others = OutlierSpace.of(X, labels, WIDTHS, trials=some).scores(X)
    for score, expected in zip(among_others, alone, strict=True):
        assert score == pytest.approx(expected, rel=1e-9)


def test_few_trials_have_few_components():
    X, labels = trials(12)
    assert OutlierSpace.of(X, labels, WIDTHS).weights.shape == (30, 4)
    X, labels = trials(400)
    assert OutlierSpace.of(X, labels, WIDTHS).weights.shape[1] <= MOST_COMPONENTS


def test_of_many_trials_what_lies_between_the_poses_of_a_label_is_remote(monkeypatch):
    monkeypatch.setattr(outlier_score, "MOST_ROWS", 20)
    monkeypatch.setattr(outlier_score, "MOST_CENTRES", 24)
    hidden = np.random.default_rng(0).normal(size=(2, 400, 6))
    labels = np.array(list("ab"))[np.arange(400) % 2]
    mixing = np.random.default_rng(1).normal(size=(6, 30))
    pose = np.where(np.arange(400) % 4 < 2, 10.0, -10.0)
    hidden[..., 0] += np.where(labels == "a", 0.0, 40.0) + pose
    space = OutlierSpace.of((hidden @ mixing)[:, :200], labels[:200], WIDTHS)
    known = hidden[:, 200:]
    between = known - [10.0, 0.0, 0.0, 0.0, 0.0, 0.0] * np.sign(pose[200:, None])
    limits = np.quantile(space.scores(known @ mixing).known_distance, 0.99, axis=1)
    medians = np.median(space.scores(between @ mixing).known_distance, axis=1)
    assert (medians > 2.0 * limits).all()


def test_a_trial_is_as_far_from_a_centre_as_if_it_had_no_part_in_it():
    y = np.array([[0.0], [2.0], [10.0], [16.0], [30.0]])
    rows = np.array([[1.0], [13.0], [30.0]])
    alone = outlier_score._alone(
        y, rows, np.array([0, 0, 1, 1, 2]), np.array(list("aab"))
    )
    assert alone.tolist() == [2.0, 6.0, np.inf]


def test_the_leading_axes_are_those_of_a_scatter_with_known_ones():
    reflection = np.eye(60) - np.full((60, 60), 2.0 / 60)  # its columns are the axes
    values = np.arange(1.0, 61.0) ** 2
    leading, axes = outlier_score._leading((reflection * values) @ reflection, 9)
    assert leading == pytest.approx(values[-9:], rel=1e-12)
    assert np.abs(reflection.T @ axes)[-9:] == pytest.approx(np.eye(9), abs=1e-11)


def test_a_scatter_with_fewer_axes_has_the_same_ones_each_time():
    """Lanczos' method would go on from random vectors."""
    rows = np.random.default_rng(0).normal(size=(4, 50))
    scatter = rows.T @ rows
    values, axes = outlier_score._leading(scatter, 9)
    dense = eigh(scatter, subset_by_index=[41, 49])
    assert np.array_equal(values, dense[0])
    assert np.array_equal(axes, dense[1])
    assert not outlier_score._leading(np.zeros((50, 50)), 9)[0].any()
