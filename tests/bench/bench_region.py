"""Threshold, largest region, peak, area and centroid of a frame, and of noise."""

from functools import partial

import cv2
import numpy as np
import pytest
import scipy.ndimage

from edge.demo import FOLDER
from edge.recording import load
from edge.touch.region import largest_region
from tests.edge.touch.test_region import SHAPES

THRESHOLD = 50
TOUCHES = ("cardboard-box-fixed", "foam-block-fixed")


def widest(touch):
    """The frame of a touch with the most taxels in contact."""
    frames = load(FOLDER / f"{touch}.npz").frames
    return frames[(frames > THRESHOLD).sum(axis=(1, 2)).argmax()]


def ours(frame):
    region = largest_region(frame, THRESHOLD, wraps=True)
    return None if region is None else (region.area, region.peak, region.centroid)


def scipy_numpy(frame):
    labels, n = scipy.ndimage.label(frame > THRESHOLD)
    if n == 0:
        return None
    areas = np.bincount(labels.ravel())[1:]
    mask = labels == areas.argmax() + 1
    rows, cols = np.nonzero(mask)
    return areas.max(), frame[mask].max(), (rows.mean(), cols.mean())


def components(frame):
    """OpenCV's regions; the first is what no region takes."""
    pressed = (frame > THRESHOLD).view(np.uint8)
    return cv2.connectedComponentsWithStats(pressed, connectivity=4)


def opencv(frame):
    _, labels, stats, centres = components(frame)
    if len(stats) < 2:
        return None
    i = stats[1:, cv2.CC_STAT_AREA].argmax() + 1
    return stats[i, cv2.CC_STAT_AREA], frame[labels == i].max(), centres[i]


RIVALS = {"scipy + numpy": (scipy_numpy, 1.0), "OpenCV": (opencv, 1.5)}
"""{rival: its function, and the largest time of ours over its for a touch}. More than half
of ours for a wide region is the sums of its rows and columns, one mask at a time, which
a rival's centroid leaves to numpy."""


@pytest.mark.parametrize(
    "name", [*TOUCHES, "full", "checkerboard", "serpentine", "empty"]
)
def bench_region(name, against):
    frame = widest(name) if name in TOUCHES else SHAPES[name]
    area = (ours(frame) or [0])[0]
    rivals = {}
    for rival, (method, most) in RIVALS.items():
        assert (method(frame) or [0])[0] == area
        rivals[rival] = partial(method, frame), most if name in TOUCHES else None
    against(partial(ours, frame), rivals, calls=50)


def loudest(frame):
    """The labelled areas, without the largest region's centroid, which rivals lack."""
    return largest_region(frame, THRESHOLD, wraps=False).area


def opencv_areas(frame):
    _, _, stats, _ = components(frame)
    return stats[1:, cv2.CC_STAT_AREA].max()


@pytest.mark.parametrize("density", [0.1, 0.5])
@pytest.mark.parametrize("width", [24, 256])
def bench_region_in_noise(width, density, against):
    rng = np.random.default_rng(0)
    shape = (width, width)
    counts = (rng.random(shape) < density) * rng.integers(60, 60000, shape)
    frame = counts.astype(np.uint16)
    assert loudest(frame) == opencv_areas(frame)
    rivals = {"OpenCV": (partial(opencv_areas, frame), 10.0)}
    against(partial(loudest, frame), rivals)
