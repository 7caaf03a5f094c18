"""The sketch of a simulated touch: what leans, turns or bends does so in the
picture."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from train.draw import sketch as sketches

FIRST = sketches.Place(
    position=np.array([-0.1, 0.0, -0.4]),
    normal=np.array([1.0, 0.0, 0.0]),
    row0_m=0.08,
)


def sketch(effects, moved=0.1, since=0.0, **values):
    axis = Figure().add_subplot()
    drawn = {"effects": effects, "values": values}
    now = FIRST.position + np.array([moved, 0.0, 0.0])
    return axis, sketches._object(
        axis,
        drawn,
        FIRST,
        now,
        since,
        color="blue",
        hatch="//",
    )


def outline(axis):
    (patch,) = axis.patches
    return patch.get_xy()[:-1]


def test_an_object_that_slides_stands_on_its_floor_where_it_was_pushed_to():
    still = sketch(["sliding"], 0.0)[0]
    moved = sketch(["sliding"], 0.1)[0]
    np.testing.assert_allclose(
        outline(moved) - outline(still), [[0.1, 0.0]] * len(outline(still))
    )
    floor = still.lines[0].get_ydata()[0]
    assert outline(still)[:, 1].min() == pytest.approx(floor)
    # A fixed object has not moved, however the contact did.
    np.testing.assert_array_equal(outline(sketch([], 0.1)[0]), outline(still))


def test_an_object_that_tips_stands_on_its_edge_until_it_lies():
    values = {"base_m": 0.1, "height_m": 0.25, "friction_static": 0.9}
    leaning, says = sketch(["sliding", "tipping"], 0.05, **values)
    assert says == ", leans by 11 degrees"
    floor = leaning.lines[0].get_ydata()[0]
    assert outline(leaning)[:, 1].min() == pytest.approx(floor)
    lying, says = sketch(["sliding", "tipping"], 0.2, since=0.5, **values)
    assert says == ", has fallen over"
    assert outline(lying)[:, 1].min() == pytest.approx(floor)
    assert np.ptp(outline(lying)[:, 1]) == pytest.approx(0.1)


def test_the_title_says_by_how_much_an_object_turns():
    values = {"aside_m": 0.05, "foot_m": 0.3}
    angle = 0.1 * 0.05 / (0.1**2 + 0.05**2)
    motion = sketch(["sliding", "turning"], 0.1, **values)[1]
    assert motion == f", turns by {np.degrees(angle):.0f} degrees"
    assert sketch(["sliding", "turning"], 0.0, **values)[1] == ""


def test_a_plants_stems_bend_to_where_the_forearm_is():
    values = {"stem_count": 5, "stem_spread_m": 0.08}
    axis, _ = sketch(["stems"], 0.1, **values)
    stems = axis.lines[1:]
    assert len(stems) == 5
    for stem in stems:
        (foot, tip), (floor, top) = stem.get_xdata(), stem.get_ydata()
        share = (FIRST.position[2] - floor) / (top - floor)
        assert foot + share * (tip - foot) == pytest.approx(
            0.0
        )  # at the contact's height
    pushed, _ = sketch(["stems", "sliding"], 0.1, **values)
    for stem in pushed.lines[1:]:
        assert np.ptp(stem.get_xdata()) == 0.0


def test_the_skin_is_seen_as_thick_as_it_is_and_the_object_no_higher_than_it(forearm):
    upright = np.eye(4)
    corners = sketches.skin_outline(upright, forearm)
    assert np.ptp(corners[:, 0]) == pytest.approx(2 * forearm.radius_m)
    assert corners[:, 1].max() == pytest.approx(forearm.row0_z_m)
    assert np.ptp(corners[:, 1]) == pytest.approx(15 * forearm.pitch[0])
    tall = outline(sketch([], width_m=1.0)[0])
    assert tall[:, 1].max() == pytest.approx(FIRST.position[2] + FIRST.row0_m)
