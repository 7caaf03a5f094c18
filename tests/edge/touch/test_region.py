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
    cols = active.shape[1]
    labels, n = scipy.ndimage.label(np.hstack([active] * (1 + wraps)))
    masks: list[np.ndarray] = []
    for i in range(n):
        mask = (labels[:, :cols] == i + 1) | (labels[:, -cols:] == i + 1)
        overlapping = [m for m in masks if (m & mask).any()]
        masks = [m for m in masks if not (m & mask).any()]
        masks.append(np.logical_or.reduce([mask, *overlapping]))
    return masks


def described(mask, area, peak, rows):
    """Sorts the largest area first, then the higher peak, then the lower index."""
    return -int(area), -int(peak), lowest_index(mask), int(rows), mask.tobytes()


def lowest_index(mask):
    return int(mask.argmax())


def by_scipy(counts, threshold, valid, wraps):
    """All regions, and the largest."""
    active = counts > threshold
    if valid is not None:
        active &= valid
    regions = sorted(
        described(mask, mask.sum(), counts[mask].max(), mask.nonzero()[0].sum())
        for mask in reference_masks(active, wraps)
    )
    return regions, regions[:1]


def by_us(counts, threshold, valid, wraps):
    """The same from `find_regions` and `largest_region`."""
    options = {"valid": valid, "wraps": wraps}
    largest = largest_region(counts, threshold, **options)
    answers = (
        find_regions(counts, threshold, **options),
        [largest] * (largest is not None),
    )
    return tuple(
        [described(r.mask, r.area, r.peak, r.sums[0]) for r in regions]
        for regions in answers
    )


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


def test_a_threshold_for_each_taxel():
    counts = frame((2, 2), (2, 3))
    threshold = np.full((16, 24), 99)
    threshold[2, 3] = 100
    region = largest_region(counts, threshold)
    assert (region.area, lowest_index(region.mask)) == (1, 2 * 24 + 2)


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


def first_row(counts, before=None):
    return lowest_index(largest_region(counts, 50, previous=before).mask) // 24


@pytest.mark.parametrize("width", [1, 2])
def test_equal_areas_go_to_the_overlap_then_the_peak_then_the_lowest_index(width):
    places = [(row, col) for row in (1, 8, 12) for col in range(3, 3 + width)]
    counts = frame(*places)
    assert first_row(counts) == 1
    counts[8, 3] = counts[12, 3] = 200
    assert first_row(counts) == 8
    for row, expected in ((12, 12), (1, 1), (15, 8)):
        before = largest_region(frame((row, 2), (row, 3)), 50)
        assert first_row(counts, before) == expected


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
