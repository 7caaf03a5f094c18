"""Pictures of a report: the same numbers give the same bytes, for a page and for a
phone."""

import io

import numpy as np
from matplotlib.image import imread

from train.report.figures import PHONE, confusion


def test_the_same_numbers_give_the_same_bytes_and_others_do_not():
    truth = np.array(["a", "a", "b"])
    said = np.array(["a", "z", "b"])
    first = confusion("n", "t", truth, said)
    assert first == confusion("n", "t", truth, said)
    assert first.png != confusion("n", "t", truth, truth).png
    assert imread(io.BytesIO(first.narrow)).shape[1] == PHONE * 200
