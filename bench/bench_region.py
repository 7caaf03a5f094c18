"""Threshold, largest region, peak, area and centroid of a 16 x 24 frame."""

from functools import partial

import cv2
import numpy as np
import pytest
import scipy.ndimage

from edge.touch.region import largest_region
from tests.edge.touch.test_region import SHAPES


def contact():
    """The patch of the real contact frame (12 active taxels), in counts of 1000 a newton."""
    frame = np.zeros((16, 24), dtype=np.uint16)
    frame[6:10, 9:11] = [[1530, 1530], [1130, 560], [1360, 610], [1210, 1050]]
    frame[14, 22:] = 80, 60
    frame[15, 21:23] = 80, 100
    return frame


def large():
    """A soft contact of 30 taxels, highest in the middle."""
    rows, cols = np.mgrid[:16, :24]
    force = 1200 - 250 * np.hypot((rows - 6) / 0.9, cols - 12)
    return np.where(force > 50, force, 0).astype(np.uint16)


FRAMES = {"contact": contact(), "soft contact": large()} | {
    name: SHAPES[name] for name in ("full", "checkerboard", "serpentine", "empty")
}


def ours(frame):
    region = largest_region(frame, 50, wraps=True)
    return None if region is None else (region.area, region.peak, region.centroid)


def scipy_numpy(frame):
    labels, n = scipy.ndimage.label(frame > 50)
    if n == 0:
        return None
    areas = np.bincount(labels.ravel())[1:]
    mask = labels == areas.argmax() + 1
    rows, cols = np.nonzero(mask)
    return areas.max(), frame[mask].max(), (rows.mean(), cols.mean())


def opencv(frame):
    _, labels, stats, centres = cv2.connectedComponentsWithStats(
        (frame > 50).view(np.uint8), connectivity=4
    )
    if len(stats) < 2:
        return None
    i = stats[1:, cv2.CC_STAT_AREA].argmax() + 1
    return stats[i, cv2.CC_STAT_AREA], frame[labels == i].max(), centres[i]


RIVALS = {"scipy + numpy": scipy_numpy, "OpenCV": opencv}
MOST = {"scipy + numpy": 0.6, "OpenCV": 1.5}


@pytest.mark.parametrize("name", FRAMES)
def bench_region(name, against):
    frame = FRAMES[name]
    areas = {(method(frame) or [0])[0] for method in (ours, *RIVALS.values())}
    assert len(areas) == 1
    rivals = {rival: partial(method, frame) for rival, method in RIVALS.items()}
    against(partial(ours, frame), rivals, most=MOST if "contact" in name else {}, calls=50)
