"""Folds of trials and of groups, and a part that stands for all."""

import numpy as np
import pytest

from train.data.folds import group_folds, representative, stratified_folds


def test_folds_of_groups_part_no_group():
    groups = np.repeat([f"{i}" for i in range(12)], 4)
    few = group_folds(groups, count=5)
    assert all(len(set(few[groups == name])) == 1 for name in groups)


def test_folds_spread_each_class_evenly():
    y = np.repeat(["a", "b"], [30, 14])
    folds = stratified_folds(y, 10)
    assert sorted(np.bincount(folds[y == "a"])) == [3] * 10
    assert np.bincount(folds).max() - np.bincount(folds).min() <= 1
    assert (folds == stratified_folds(y, 10)).all()


def test_a_representative_part_has_every_set_of_labels_and_their_shares():
    labels = np.repeat(["cup", "can", "box"], [600, 399, 1])
    y = {"object": labels, "side": np.array(["left", "right"] * 500)}
    part = representative(y, 100)
    assert part.tolist() == sorted(set(part.tolist()))
    assert part.tolist() == representative(y, 100).tolist()
    counts = {name: int((labels[part] == name).sum()) for name in set(labels)}
    assert counts["box"] == 1
    assert counts["cup"] == pytest.approx(60, abs=2)
    assert counts["can"] == pytest.approx(40, abs=2)
    assert representative(y, 1000).tolist() == list(range(1000))
