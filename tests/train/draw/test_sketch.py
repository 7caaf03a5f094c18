"""The sketch of the arm: its skin, and the place of the contact."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from edge import demo
from edge.recording import load
from train.data.arms import arm_of
from train.draw import sketch as sketches


def drawn(recording):
    axis = Figure().add_subplot()
    chain = arm_of(recording, "touch")
    sketches.draw_side(axis, recording, chain, recording.layout, 0.3)
    return axis


def test_a_star_marks_each_contact_on_the_skin_of_its_moment():
    touch = load(demo.recordings()[0])
    axis = drawn(touch)
    stars = [line for line in axis.lines if line.get_marker() == "*"]
    assert len(stars) == len(axis.patches) == 2
    for star, skin in zip(stars, axis.patches, strict=True):
        _, top, bottom, *_ = skin.get_xy()  # of the side that the object touches
        z = star.get_ydata()[0]
        assert bottom[1] < z < top[1]
        front = np.interp(z, [bottom[1], top[1]], [bottom[0], top[0]])
        assert star.get_xdata()[0] == pytest.approx(front, abs=2e-3)
    untouched = drawn(replace(touch, frames=np.zeros_like(touch.frames)))
    assert [line.get_marker() for line in untouched.lines] == ["o", "o"]


def test_the_skin_is_seen_as_thick_and_as_long_as_it_is(forearm):
    upright = np.eye(4)
    corners = sketches.skin_outline(upright, forearm)
    assert np.ptp(corners[:, 0]) == pytest.approx(2 * forearm.radius_m)
    assert corners[:, 1].max() == pytest.approx(forearm.row0_z_m)
    assert np.ptp(corners[:, 1]) == pytest.approx(15 * forearm.pitch[0])
