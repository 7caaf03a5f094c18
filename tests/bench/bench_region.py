"""Threshold, largest region, peak, area and centroid of a frame."""

from functools import partial

import cv2
import numpy as np
import pytest

from edge.demo import FOLDER
from edge.recording import load
from edge.touch.region import largest_region
from tests.edge.touch.test_components import SHAPES

THRESHOLD = 50
TOUCHES = ("cardboard-box-fixed", "foam-block-fixed")


def widest(touch):
    """The frame of a touch with the most taxels in contact."""
    frames = load(FOLDER / f"{touch}.npz").frames
    return frames[(frames > THRESHOLD).sum(axis=(1, 2)).argmax()]


def ours(frame):
    region = largest_region(frame, THRESHOLD, wraps=True)
    return None if region is None else (region.area, region.peak, region.centroid)


def opencv(frame):
    """OpenCV's largest region; its first is what no region takes."""
    pressed = (frame > THRESHOLD).view(np.uint8)
    count, labels, stats, centres = cv2.connectedComponentsWithStats(
        pressed, connectivity=4
    )
    if count < 2:
        return None
    i = stats[1:, cv2.CC_STAT_AREA].argmax() + 1
    return stats[i, cv2.CC_STAT_AREA], frame[labels == i].max(), centres[i]


MOST = 1.5
"""Largest time of ours over OpenCV's for a touch. More than half of ours for a wide
region is the sums of its rows and columns, one mask at a time, which OpenCV's centroid
leaves out."""


@pytest.mark.parametrize("name", [*TOUCHES, *SHAPES])
def bench_region(name, against):
    frame = widest(name) if name in TOUCHES else np.uint16(100) * SHAPES[name]
    assert (opencv(frame) or [0])[0] == (ours(frame) or [0])[0]
    rivals = {"OpenCV": (partial(opencv, frame), MOST if name in TOUCHES else None)}
    against(partial(ours, frame), rivals, calls=50)
