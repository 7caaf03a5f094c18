"""The nearest consistent answer, beside every one of them written out."""

import itertools

import numpy as np

from edge.decide.agreement import agreed, product_label

FACTORS = {"mobility": (0, 1, 0, 1), "softness": (0, 0, 1, 1)}


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


def test_two_labels_decided_apart_name_the_label_of_their_product():
    assert product_label(FACTORS, {"mobility": 1, "softness": 0}) == 1
    assert product_label(FACTORS, {"softness": 1, "mobility": 0}) == 2
