"""What is chosen among, and in which order of cost."""

import numpy as np

from edge.touch.feature_sets import expand
from train.candidates import PLAIN, WITH_JOINTS, candidates, costs, groupable, products
from train.pipeline import Choice

TASKS = {
    "category": np.array(["rigid-fixed", "rigid-movable", "soft-fixed", "soft-movable"]),
    "mobility": np.array(["fixed", "movable", "fixed", "movable"]),
    "object": np.array(["wall", "box", "pillow", "ball"]),
    "softness": np.array(["rigid", "rigid", "soft", "soft"]),
}


def test_a_task_is_the_product_of_two_others_where_their_labels_say_so():
    assert products(TASKS)["category"] == ("mobility", "softness")
    assert "mobility" not in products(TASKS)
    assert products({task: TASKS[task] for task in ("category", "mobility")}) == {}


def test_features_of_joints_are_candidates_where_recordings_have_them():
    assert {one.sets for one in candidates(TASKS)} == set(PLAIN)
    assert {one.sets for one in candidates(TASKS, joints=True)} == set(WITH_JOINTS)
    assert len(candidates(TASKS, joints=True, quick=True)) == 3


def test_what_is_given_is_fixed():
    found = candidates(TASKS, features=["paper"], projection="pca", scaling="V", components=3, k=2)
    (one,) = found
    (grid,) = one.grids
    assert (one.name, grid.scaling, grid.components, grid.neighbours) == ("paper", "V", (3,), (2,))
    assert grid.features == expand(["paper"])


def test_whole_objects_can_be_left_out_where_each_class_has_several():
    objects = np.array(list("aabbccddeeff"))
    assert groupable(np.repeat(["x", "y"], 6), objects)
    assert not groupable(np.repeat(["x", "y"], [8, 4]), objects)
    assert not groupable(np.full(12, "x"), objects)


def test_the_fewest_weights_are_cheapest_whatever_the_shrinkage_and_k():
    choices = [
        Choice("IV", 3, 1, "lda", 0.1, ("a", "b")),
        Choice("IV", 3, 5, "lda", 1.0, ("a", "b")),
        Choice("IV", 3, 1, "lda", 0.1, ("a",)),
        Choice("I", 2, 1, "pca", 0.1, ("a",)),
        Choice("IV", 20, 1, "pca", 0.1, ("a",)),
    ]
    assert costs(choices, {"a": 10, "b": 11}).tolist() == [1, 1, 0, 2, 2]


def test_of_equally_many_weights_those_listed_first_are_cheaper():
    choices = [Choice("IV", 1, 1, "lda", features=(name,)) for name in ("b", "a", "c")]
    assert costs(choices, {"a": 5, "b": 5, "c": 4}).tolist() == [1, 2, 0]
