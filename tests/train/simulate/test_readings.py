"""Frames hold whole counts within the converter's range."""

import numpy as np

from train.simulate.readings import FULL, Readings


def test_a_count_is_the_nearest_whole_one_that_the_converter_can_read():
    counts = np.array([0.5, 1.5, 2.4, -3.0, FULL - 0.4, 1e9], dtype=np.float32)
    reading = Readings(None, None, (), 0, np.zeros(1), counts, np.zeros((1, 1)))
    assert reading.frames().dtype == np.uint16
    assert reading.frames().tolist() == [0, 2, 2, 0, 65535, 65535]
