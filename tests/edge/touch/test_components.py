"""Components labelled by runs are those of scipy.ndimage.label, the seam joined."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from edge.touch.components import components_of
from edge.touch.region import find_regions
from tests.edge.touch.test_region import reference_masks, serpentine


def padded(active):
    return np.hstack([active, np.zeros((len(active), 1), dtype=bool)])


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
    "none": np.zeros((5, 7), dtype=bool),
    "all": np.ones((5, 7), dtype=bool),
    "one": np.ones((1, 1), dtype=bool),
    "row": np.array([[True, False, True, True]]),
    "spiral": spiral(40),
    "comb": comb(41),
    "upside down": comb(41)[::-1],
    "serpentine": serpentine(64, 96) > 0,
}


@pytest.mark.parametrize("wraps", [False, True])
@pytest.mark.parametrize("name", SHAPES)
def test_shapes_have_the_components_of_scipy(name, wraps):
    assert_same(SHAPES[name], wraps)


def assert_same(active, wraps):
    components = components_of(padded(active), wraps)
    labels = np.full(active.shape, -1)
    labels[active] = components.of_taxel
    masks = reference_masks(active, wraps)
    masks.sort(key=lambda mask: np.flatnonzero(mask)[0])
    expected = np.full(active.shape, -1)
    for number, mask in enumerate(masks):
        expected[mask] = number
    np.testing.assert_array_equal(labels, expected)
    assert components.areas.tolist() == [int(mask.sum()) for mask in masks]


@settings(max_examples=30, deadline=None)
@given(
    rows=st.integers(1, 40),
    cols=st.integers(1, 40),
    density=st.floats(0.0, 1.0),
    wraps=st.booleans(),
    seed=st.integers(0, 10**6),
)
def test_noise_of_any_density_has_the_components_of_scipy(
    rows,
    cols,
    density,
    wraps,
    seed,
):
    active = np.random.default_rng(seed).random((rows, cols)) < density
    assert_same(active, wraps)


def test_counts_below_zero_have_their_peak():
    counts = np.array([[-5, -3, -9, -4]], dtype=np.int64)
    regions = find_regions(counts, -6, wraps=False)
    assert [(region.area, region.peak) for region in regions] == [(2, -3), (1, -4)]
