"""Shear as arrows: the taxels that have one, and where each points."""

import numpy as np
import pytest

from edge.tools import terminal
from edge.tools.arrows import WAYS, characters, region_shear
from edge.touch.frame import Frame
from edge.touch.region import find_regions


def sheared(along, around) -> np.ndarray:
    return np.full((2, 3, 2), (along, around), dtype=np.int64)


@pytest.mark.parametrize(
    ("along", "around", "arrow"),
    [
        (0, 9, "→"),
        (9, 9, "↘"),
        (9, 0, "↓"),
        (9, -9, "↙"),
        (0, -9, "←"),
        (-9, -9, "↖"),
        (-9, 0, "↑"),
        (-9, 9, "↗"),
    ],
)
def test_rows_run_down_and_columns_to_the_right(along, around, arrow):
    assert characters(sheared(along, around)) == [[arrow] * 3]
    assert len(set(WAYS)) == 8


def test_two_rows_share_an_arrow_and_short_ones_are_left_out():
    shear = np.zeros((3, 3, 2), dtype=np.int64)
    shear[0, 0] = 5, 0
    shear[1, 0] = 5, 0
    shear[1, 1] = 1, 0
    shear[2, 2] = 0, 5
    assert characters(shear) == [["↓", "", ""], ["", "", "→"]]


def test_only_taxels_in_contact_have_shear():
    counts = np.zeros((2, 3), dtype=np.uint16)
    counts[0, 1] = 200
    frame = Frame(0.0, counts, shear=np.full((2, 3, 2), 7, dtype=np.int16))
    shear = region_shear(frame, find_regions(counts, 100, wraps=False))
    assert np.argwhere(shear.any(axis=2)).tolist() == [[0, 1]]
    assert shear[0, 1].tolist() == [7, 7]
    one_axis = Frame(0.0, counts)
    assert region_shear(one_axis, []) is None


def test_an_arrow_stands_on_the_colour_of_its_taxel():
    colour = np.array([[1, 1, 2], [3, 3, 3]], dtype=np.uint8)
    text = terminal.picture(colour, wide=2, arrows=[["", "↓", ""]])
    assert text == (
        "\x1b[38;5;1;48;5;3m▀▀\x1b[38;5;16;48;5;1m↓ \x1b[38;5;2;48;5;3m▀▀\x1b[0m"
    )
