"""Components labelled by runs, of winding shapes and of counts below zero; those of noise
are in `test_region`."""

import numpy as np
import pytest

from edge.touch.region import find_regions
from tests.edge.touch.test_region import by_scipy, by_us, serpentine


def spiral(side):
    """One winding run of taxels, whose ends are far apart along it."""
    out = np.zeros((side, side), dtype=bool)
    place = np.zeros(2, dtype=int)
    step = np.array([0, 1])
    # Three sides of the square, then two of each smaller one.
    lengths = [side - 1, *np.repeat(np.arange(side - 1, 0, -2), 2)]
    for length in lengths:
        for _ in range(length):
            out[*place] = True
            place += step
        step = np.array([step[1], -step[0]])
    return out


def comb(side):
    """Teeth that only the last row joins: each is a component until then."""
    out = np.zeros((side, side), dtype=bool)
    out[:, ::2] = True
    out[-1] = True
    return out


SHAPES = {
    "spiral": spiral(40),
    "comb": comb(41),
    "upside down": comb(41)[::-1],
    "serpentine": serpentine(64, 96) > 0,
}


@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize("name", SHAPES)
def test_shapes_have_the_regions_of_scipy(name, wraps):
    arguments = SHAPES[name].astype(np.uint16), 0, None, wraps
    assert by_us(*arguments) == by_scipy(*arguments)


def test_counts_below_zero_have_their_peak():
    counts = np.array([[-5, -3, -9, -4]], dtype=np.int64)
    regions = find_regions(counts, -6, wraps=False)
    assert [(region.area, region.peak) for region in regions] == [(2, -3), (1, -4)]
