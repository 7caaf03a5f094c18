"""Coarser and thinner skins."""

from dataclasses import replace

import numpy as np
import pytest

from edge.recording import Recording
from edge.touch.layout import SkinLayout
from train.report.skins import coarser, pool, pooled, pooled_layout


def test_pooling_keeps_the_sum_of_forces(forearm, make_touch):
    touch = make_touch(seed=3)
    skin = pooled_layout(forearm)
    summed = pooled(touch, skin)
    assert summed.frames.shape[1:] == skin.shape == (8, 12)
    total = touch.frames.astype(int).sum(axis=(1, 2))
    assert summed.frames.astype(int).sum(axis=(1, 2)).tolist() == total.tolist()


def test_a_sum_that_leaves_sixteen_bits_saturates():
    full = Recording(t=np.zeros(1), frames=np.full((1, 4, 4), 65535, dtype=np.uint16))
    skin = pooled_layout(SkinLayout(4, 4))
    assert (pooled(full, skin).frames == 65535).all()


def test_resolutions_are_the_papers(forearm):
    assert [s.rows * s.cols for s, _ in coarser(forearm, [])] == [96, 24, 6, 1]
    assert [s.rows * s.cols for s, _ in coarser(SkinLayout(13, 13), [])] == [
        49,
        16,
        4,
        1,
    ]


def test_a_larger_taxel_lies_in_the_middle_of_its_parts(forearm):
    for skin in (
        forearm,
        replace(forearm, column_angles_deg=tuple(15.0 * c for c in range(24))),
    ):
        coarse = pooled_layout(skin)
        for row, col in ((0, 0), (3, 5), (7, 11)):
            angles = [
                skin.position(2 * row + r, 2 * col + c) for r in (0, 1) for c in (0, 1)
            ]
            middle = np.mean(angles, axis=0)
            place = coarse.position(row, col)
            assert place[2] == pytest.approx(middle[2])
            radial = place[:2] / np.linalg.norm(place[:2])
            assert radial == pytest.approx(middle[:2] / np.linalg.norm(middle[:2]))


def test_invalid_taxels_count_as_nothing_and_odd_edges_stand_alone():
    valid = np.ones((3, 3), dtype=bool)
    valid[0, 1] = valid[2, 2] = False
    frames = np.full((1, 3, 3), 10, dtype=np.uint16)
    touch = Recording(t=np.zeros(1), frames=frames, valid=valid)
    skin = pooled_layout(replace(SkinLayout(3, 3), dead=(1, 8)))
    coarse = pooled(touch, skin)
    assert coarse.frames[0].tolist() == [[30, 20], [20, 0]]
    assert coarse.valid.tolist() == [[True, True], [True, False]]
    assert skin.dead == (3,)
    assert pool(frames).tolist() == [[[40, 20], [20, 10]]]
