"""Components labelled by runs, of winding shapes and of counts below zero; those of noise
are in `test_region`."""

import numpy as np
import pytest

from edge.touch.region import find_regions
from tests.edge.touch.test_region import by_scipy, by_us


def comb(side):
    """Teeth that only the last row joins: each is a component until then."""
    out = np.zeros((side, side), dtype=np.uint16)
    out[:, ::2] = 1
    out[-1] = 1
    return out


def serpentine(rows, cols):
    """One winding run of taxels, whose ends are far apart along it."""
    out = np.zeros((rows, cols), dtype=np.uint16)
    out[::2] = 1
    out[1::4, -1] = 1
    out[3::4, 0] = 1
    return out


SHAPES = {
    "comb": comb(41),
    "upside down": comb(41)[::-1],
    "serpentine": serpentine(64, 96),
}


@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize("name", SHAPES)
def test_shapes_have_the_regions_of_scipy(name, wraps):
    arguments = SHAPES[name], 0, None, wraps
    assert by_us(*arguments) == by_scipy(*arguments)


def test_counts_below_zero_have_their_peak():
    counts = np.array([[-5, -3, -9, -4]], dtype=np.int64)
    regions = find_regions(counts, -6, wraps=False)
    assert [(region.area, region.peak) for region in regions] == [(2, -3), (1, -4)]
