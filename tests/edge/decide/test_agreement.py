"""The nearest consistent answer, beside every one of them written out."""

import itertools

import numpy as np
import pytest

from edge.decide.agreement import agreed, factors_fit, joint_label

FACTORS = {"mobility": (0, 1, 0, 1), "softness": (0, 0, 1, 1)}
SWAPPED = {"mobility": (0, 1, 0, 1), "softness": (1, 1, 0, 0)}
TWICE = {"mobility": (0, 1, 0, 0), "softness": (0, 0, 1, 1)}
"""A pair stands for two labels, and another for none."""
MADE = "rigid-fixed rigid-movable soft-fixed soft-movable"


def test_the_answer_has_the_smallest_sum_of_all_that_agree():
    rng = np.random.default_rng(0)
    category, mobility, softness = rng.integers(0, 9, (3, 200, 4))
    distances = {
        "category": category,
        "mobility": mobility[:, :2],
        "softness": softness[:, :2],
    }
    labels, nearest = agreed("category", FACTORS, distances)
    for i in range(200):
        sums = {
            (m, s): category[i, 2 * s + m] + mobility[i, m] + softness[i, s]
            for m, s in itertools.product((0, 1), repeat=2)
        }
        m = labels["mobility"][i]
        s = labels["softness"][i]
        assert sums[m, s] == min(sums.values())
        assert labels["category"][i] == 2 * s + m
        assert nearest["softness"][i].tolist() == [
            min(sums[0, s], sums[1, s]) for s in (0, 1)
        ]


def test_two_labels_decided_apart_name_the_label_of_their_joint_task():
    assert joint_label(FACTORS, {"mobility": 1, "softness": 0}) == 1
    assert joint_label(FACTORS, {"softness": 1, "mobility": 0}) == 2


@pytest.mark.parametrize(
    ("names", "pairs", "fit"),
    [
        (MADE, FACTORS, True),
        (MADE, SWAPPED, False),
        ("wall box sofa pillow", FACTORS, True),
        ("wall box sofa pillow", TWICE, False),
    ],
)
def test_labels_that_are_made_of_their_factors_labels_stand_for_these(
    names, pairs, fit
):
    labels = {"mobility": ("fixed", "movable"), "softness": ("rigid", "soft")}
    labels["category"] = tuple(names.split())
    assert factors_fit(pairs, labels, "category") is fit
