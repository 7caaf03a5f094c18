"""Frames hold whole counts within the converter's range."""

import numpy as np
import pytest

from tests.train.simulate.scenes import one_object, scene
from train.simulate.readings import FULL, Readings

SCENE = scene(one_object(), skin={"rows": 2, "cols": 4}, motion={"place_m": 0.18})


@pytest.mark.parametrize(
    ("count", "whole"),
    [(0.5, 0), (1.5, 2), (2.4, 2), (-3.0, 0), (FULL - 0.4, 65535), (1e9, 65535)],
)
def test_a_count_is_the_nearest_whole_one_that_the_converter_can_read(count, whole):
    counts = np.zeros((3, 2, 4), dtype=np.float32)
    counts[1, 1, 2] = count
    reading = Readings(
        SCENE,
        None,
        (),
        0,
        np.arange(3) / 100.0,
        counts,
        np.zeros((3, 1)),
    )
    want = np.zeros((3, 2, 4), dtype=np.uint16)
    want[1, 1, 2] = whole
    assert reading.frames().dtype == np.uint16
    np.testing.assert_array_equal(reading.frames(), want)
