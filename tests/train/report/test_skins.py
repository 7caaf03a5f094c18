"""Coarser and thinner skins."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from edge.record.recording import Recording
from edge.touch.layout import SkinLayout
from train.report.skins import coarser, pool, pooled, pooled_layout


def test_a_sum_that_leaves_sixteen_bits_saturates():
    full = Recording(t=np.zeros(1), frames=np.full((1, 4, 4), 65535, dtype=np.uint16))
    skin = pooled_layout(SkinLayout(4, 4))
    assert (pooled(full, skin).frames == 65535).all()


def test_resolutions_are_the_papers(forearm):
    assert taxels(forearm) == [96, 24, 6, 1]
    assert taxels(SkinLayout(13, 13)) == [49, 16, 4, 1]


def taxels(layout):
    return [skin.rows * skin.cols for skin, _ in coarser(layout, [])]


@pytest.mark.parametrize("angles", [None, tuple(np.arange(24) * 15.0)])
@pytest.mark.parametrize(("row", "col"), [(0, 0), (3, 5), (7, 11)])
def test_a_larger_taxel_lies_in_the_middle_of_its_parts(forearm, angles, row, col):
    skin = replace(forearm, column_angles_deg=angles)
    places = product((2 * row, 2 * row + 1), (2 * col, 2 * col + 1))
    middle = np.mean([skin.position(*place) for place in places], axis=0)
    place = pooled_layout(skin).position(row, col)
    assert place[2] == pytest.approx(middle[2])
    assert direction(place) == pytest.approx(direction(middle))


def direction(place):
    """The direction from the arm's axis, (x, y)."""
    return place[:2] / np.linalg.norm(place[:2])


VALID = np.array([[True, False, True], [True, True, True], [True, True, False]])
TENS = np.full((1, 3, 3), 10, dtype=np.uint16)


def test_odd_edges_stand_alone():
    assert pool(TENS).tolist() == [[[40, 20], [20, 10]]]


def test_invalid_taxels_count_as_nothing():
    touch = Recording(t=np.zeros(1), frames=TENS, valid=VALID)
    coarse = pooled(touch, pooled_layout(SkinLayout(3, 3)))
    assert coarse.frames[0].tolist() == [[30, 20], [20, 0]]
    assert coarse.valid.tolist() == [[True, True], [True, False]]


def test_a_larger_taxel_is_dead_where_all_its_parts_are():
    assert pooled_layout(replace(SkinLayout(3, 3), dead=(1, 8))).dead == (3,)
