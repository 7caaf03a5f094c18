"""Coarser and thinner skins."""

from dataclasses import replace

import numpy as np
import pytest

from edge.recording import Recording
from edge.touch.layout import SkinLayout
from train.report.skins import masked, pool, pooled, pooled_layout, thinned
from train.study.resolution import layouts


def test_pooling_keeps_the_sum_of_forces_and_maximum_the_peak(forearm, make_touch):
    touch = make_touch(seed=3)
    skin = pooled_layout(forearm)
    summed = pooled(touch, skin, np.add)
    assert summed.frames.shape[1:] == skin.shape == (8, 12)
    total = touch.frames.astype(int).sum(axis=(1, 2))
    assert summed.frames.astype(int).sum(axis=(1, 2)).tolist() == total.tolist()
    peaks = pooled(touch, skin, np.maximum).frames.max(axis=(1, 2))
    assert peaks.tolist() == touch.frames.max(axis=(1, 2)).tolist()


def test_a_sum_that_leaves_sixteen_bits_saturates():
    full = Recording(t=np.zeros(1), frames=np.full((1, 4, 4), 65535, dtype=np.uint16))
    skin = pooled_layout(SkinLayout(4, 4))
    assert (pooled(full, skin, np.add).frames == 65535).all()


def test_resolutions_are_the_papers(forearm):
    assert [s.rows * s.cols for s in layouts(forearm)] == [384, 96, 24, 6, 1]
    assert [s.rows * s.cols for s in layouts(SkinLayout(13, 13))] == [169, 49, 16, 4, 1]


def test_a_larger_taxel_lies_in_the_middle_of_its_parts(forearm):
    for skin in (forearm, replace(forearm, column_angles_deg=tuple(15.0 * c for c in range(24)))):
        coarse = pooled_layout(skin)
        for row, col in ((0, 0), (3, 5), (7, 11)):
            angles = [skin.position(2 * row + r, 2 * col + c) for r in (0, 1) for c in (0, 1)]
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
    coarse = pooled(touch, skin, np.add)
    assert coarse.frames[0].tolist() == [[30, 20], [20, 0]]
    assert coarse.valid.tolist() == [[True, True], [True, False]]
    assert skin.dead == (3,)
    assert pool(frames).tolist() == [[[40, 20], [20, 10]]]


def test_fewer_chips_are_read_evenly(forearm):
    for share in (1, 2, 4, 8):
        kept = thinned(forearm.shape, share)
        assert kept.sum() == 384 // share
        blocks = kept.reshape(4, 4, 8, 3)
        assert (blocks.all(axis=(1, 3)) == blocks.any(axis=(1, 3))).all()
        assert (kept <= thinned(forearm.shape, max(share // 2, 1))).all()


def test_what_is_not_read_is_invalid(make_touch):
    touch = make_touch()
    kept = thinned((16, 24), 4)
    less = masked(touch, kept)
    assert (less.valid == kept).all()
    assert not less.frames[:, ~kept].any()
