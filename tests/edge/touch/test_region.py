"""Regions against scipy.ndimage.label, with the seam joined by hand where the skin
wraps."""

from fractions import Fraction

import numpy as np
import pytest
import scipy.ndimage
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from edge.errors import InputError
from edge.touch.grid import best_cut
from edge.touch.region import find_regions, largest_region


def frame(*taxels: tuple[int, int], shape=(16, 24), value=100) -> np.ndarray:
    out = np.zeros(shape, dtype=np.uint16)
    for row, col in taxels:
        out[row, col] = value
    return out


def reference_masks(active: np.ndarray, wraps: bool) -> list[np.ndarray]:
    """scipy's components; where the skin wraps, those that meet across the seam are
    joined."""
    if not wraps:
        labels, n = scipy.ndimage.label(active)
        return [labels == i + 1 for i in range(n)]
    cols = active.shape[1]
    labels, n = scipy.ndimage.label(np.hstack([active, active]))
    masks: list[np.ndarray] = []
    for i in range(n):
        mask = (labels[:, :cols] == i + 1) | (labels[:, cols:] == i + 1)
        overlapping = [m for m in masks if (m & mask).any()]
        masks = [m for m in masks if not (m & mask).any()]
        masks.append(np.logical_or.reduce([mask, *overlapping]))
    return masks


def serpentine(rows: int, cols: int) -> np.ndarray:
    out = np.zeros((rows, cols), dtype=np.uint16)
    out[::2] = 100
    out[1::4, -1] = 100
    out[3::4, 0] = 100
    return out


def by_scipy(counts, threshold, valid, wraps):
    """All regions as (area, peak, lowest index, sum of rows, taxels), and the largest.

    The largest area comes first, then the higher peak, then the lower index.
    """
    active = counts > threshold
    if valid is not None:
        active &= valid
    regions = []
    for mask in reference_masks(active, wraps):
        lowest = int(np.flatnonzero(mask.ravel())[0])
        rows = int(np.nonzero(mask)[0].sum())
        regions.append(
            (int(mask.sum()), int(counts[mask].max()), lowest, rows, mask.tobytes())
        )
    regions.sort(key=lambda region: (-region[0], -region[1], region[2]))
    return regions, regions[0] if regions else None


def lowest_index(region):
    return int(np.flatnonzero(region.mask)[0])


def by_us(counts, threshold, valid, wraps):
    """The same from `find_regions` and `largest_region`."""

    def described(region):
        return (
            region.area,
            region.peak,
            lowest_index(region),
            region.sums[0],
            region.mask.tobytes(),
        )

    options = {"valid": valid, "wraps": wraps}
    regions = find_regions(counts, threshold, **options)
    largest = largest_region(counts, threshold, **options)
    return [*map(described, regions)], None if largest is None else described(largest)


@settings(max_examples=80, deadline=None)
@given(st.data(), st.integers(1, 30), st.integers(1, 30), st.booleans())
def test_random_frames_agree_with_scipy(data, rows, cols, wraps):
    seed = data.draw(st.integers(0, 2**32 - 1))
    density = data.draw(st.sampled_from([0.05, 0.5, 0.7, 0.95]))
    rng = np.random.default_rng(seed)
    counts = rng.integers(51, 54, (rows, cols)) * (rng.random((rows, cols)) < density)
    valid = rng.random((rows, cols)) < 0.9 if data.draw(st.booleans()) else None
    arguments = counts.astype(np.uint16), 50, valid, wraps
    assert by_us(*arguments) == by_scipy(*arguments)


def test_a_taxel_at_the_threshold_is_not_active():
    counts = frame((2, 2), value=50)
    assert largest_region(counts, 50) is None
    assert largest_region(counts, 49).area == 1


def test_a_threshold_for_each_taxel():
    counts = frame((2, 2), (2, 3))
    threshold = np.full((16, 24), 99)
    threshold[2, 3] = 100
    assert largest_region(counts, threshold).mask.nonzero() == (
        np.array([2]),
        np.array([2]),
    )


@given(hnp.arrays(bool, (5, 9), elements=st.booleans()))
def test_the_centroid_is_that_of_the_cut_with_the_least_variance(active):
    """Wherever the seam lies; of a full ring all cuts are equal."""
    counts = active.astype(np.uint16) * 7
    region = largest_region(counts, 0)
    if region is None:
        return
    columns = np.nonzero(region.mask)[1]
    unrolled = [(columns - cut) % 9 + cut for cut in range(9)]
    variances = [len(c) * int((c**2).sum()) - int(c.sum()) ** 2 for c in unrolled]
    centres = {
        Fraction(int(c.sum()), len(c)) % 9
        for c, variance in zip(unrolled, variances, strict=True)
        if variance == min(variances)
    }
    assert Fraction(region.sums[1], region.area) in centres


@pytest.mark.parametrize("width", [1, 2])
def test_equal_areas_go_to_the_overlap_then_the_peak_then_the_lowest_index(width):
    places = [(row, col) for row in (1, 8, 12) for col in range(3, 3 + width)]
    counts = frame(*places)
    assert lowest_index(largest_region(counts, 50)) == 1 * 24 + 3
    counts[8, 3] = counts[12, 3] = 200
    assert lowest_index(largest_region(counts, 50)) == 8 * 24 + 3
    for row, expected in ((12, 12), (1, 1), (15, 8)):
        before = largest_region(frame((row, 2), (row, 3)), 50)
        largest = largest_region(counts, 50, previous=before)
        assert lowest_index(largest) == expected * 24 + 3


@pytest.mark.parametrize(
    ("counts", "keywords", "word"),
    [
        (np.zeros((2, 2)), {}, "whole numbers"),
        (np.zeros((2, 2), np.uint16), {"valid": np.ones((2, 3), bool)}, "valid"),
        (np.ones((2, 2), np.uint16), {"threshold": np.zeros((3, 3))}, "threshold"),
    ],
)
def test_bad_arguments_are_named(counts, keywords, word):
    for of in (largest_region, find_regions):
        with pytest.raises(InputError, match=word):
            of(counts, **{"threshold": 0, **keywords})


def test_of_equally_good_cuts_of_the_circle_the_lowest_is_taken():
    assert best_cut([1, 1, 1]) == 0
    assert best_cut([5, 0, 5, 5, 0]) == 0
    assert best_cut([1, 0, 0, 1]) == 1
