"""Products of two tasks, found by the training labels."""

import numpy as np

from train.model.agreement import factors_of, families, joint_tasks

TASKS = {
    "category": np.array(
        ["rigid-fixed", "rigid-movable", "soft-fixed", "soft-movable"]
    ),
    "mobility": np.array(["fixed", "movable", "fixed", "movable"]),
    "object": np.array(["wall", "box", "pillow", "ball"]),
    "softness": np.array(["rigid", "rigid", "soft", "soft"]),
}


def test_a_task_is_the_joint_one_of_two_others_where_their_labels_say_so():
    assert joint_tasks(TASKS)["category"] == ("mobility", "softness")
    assert "mobility" not in joint_tasks(TASKS)
    assert joint_tasks({task: TASKS[task] for task in ("category", "mobility")}) == {}


def test_each_label_of_a_joint_task_stands_for_a_pair_and_no_task_is_in_two():
    """`object` is a joint task by its labels too, but its factors are taken."""
    assert joint_tasks(TASKS)["object"] == ("mobility", "softness")
    assert factors_of(TASKS) == {
        "category": {"mobility": (0, 1, 0, 1), "softness": (0, 0, 1, 1)},
    }
    assert families(TASKS) == [("category", "mobility", "softness")]


def test_a_pair_is_chosen_by_the_joint_labels_and_never_names_objects():
    """Each category holds a single object, as in nearly every first set."""
    first = {
        "category": np.array(["rigid-fixed", "rigid-movable", "soft-movable"]),
        "mobility": np.array(["fixed", "movable", "movable"]),
        "object": np.array(["box", "box", "pillow"]),
        "softness": np.array(["rigid", "rigid", "soft"]),
    }
    assert joint_tasks(first)["category"] == ("mobility", "softness")
    del first["softness"]
    assert "category" not in joint_tasks(first)


def test_without_such_words_the_pair_with_the_fewest_labels_is_taken():
    shades = {
        "kind": np.array(["a", "b", "c", "d", "e"]),
        "form": np.array(["x", "x", "y", "y", "y"]),
        "hue": np.array(["1", "2", "1", "2", "3"]),
        "tone": np.array(["1", "2", "1", "3", "4"]),
    }
    assert joint_tasks(shades)["kind"] == ("form", "hue")


def test_a_pair_that_was_never_met_is_no_label():
    """Nor is there a joint task where a factor's label is in no pair."""
    three = {task: labels[:3] for task, labels in TASKS.items()}
    pairs = {"mobility": (0, 1, 0), "softness": (0, 0, 1)}
    assert factors_of(three) == {"category": pairs}
    three["category"] = np.array(["rigid-fixed", "rigid-movable", ""])
    del three["object"]
    assert factors_of(three) == {}
