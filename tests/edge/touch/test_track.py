"""Contacts: onset, following, end; and what a series holds."""

from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.arm import Chain, Joint
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.touch.track import DEBOUNCE, MAX_CONTACTS, ContactTracker, first_contact
from tests.conftest import in_a_row
from tests.edge.touch.pressed import followed, pressed

FLAT = SkinLayout(4, 6, threshold_counts=10, onset_counts=20, pitch_m=0.01)
AT_ONCE = 1
"""The frame that confirms a contact is its first."""


def follow(peaks, debounce=DEBOUNCE, *, layout=FLAT, dt=0.01, start=0.0, **keywords):
    """The contacts of a stream, each as (onset_s, peaks, ended)."""
    tracker = ContactTracker(layout, debounce, **keywords)
    contacts = {}
    for i, peak in enumerate(peaks):
        contacts |= dict.fromkeys(
            tracker.push(pressed(layout, start + i * dt, {(1, 1): peak}))
        )
    return [(c.onset_s, c.series().peak.tolist(), c.ended) for c in contacts]


def test_onset_is_the_first_frame_of_the_run_that_confirmed_it():
    assert follow([0, 0, 30, 40, 50]) == [(0.02, [30, 40, 50], False)]


def test_one_frame_alone_begins_no_contact():
    assert follow([0, 30, 0, 30, 0]) == []
    assert follow([0, 30, 0], AT_ONCE) == [(0.01, [30, 0], False)]


@pytest.mark.parametrize(("peaks", "late"), [([30, 30], True), ([0, 30, 30], False)])
def test_a_contact_that_is_under_way_in_the_first_frame_is_late(peaks, late):
    tracker = ContactTracker(FLAT)
    frames = [pressed(FLAT, i / 100, {(1, 1): peak}) for i, peak in enumerate(peaks)]
    (contact,) = [tracker.push(frame) for frame in frames][-1]
    assert contact.late == late


def test_a_contact_begins_above_the_upper_threshold_and_lasts_to_the_lower():
    assert follow([15, 15, 20, 20]) == []
    assert follow([30, 20, 20]) == []  # a peak at onset confirms no contact
    hovering = [25, 25, 15, 25, 12, 15, 15, 15]
    assert follow(hovering) == [(0.0, hovering, False)]


def test_a_region_with_a_peak_at_onset_takes_no_contacts_place():
    """It is the largest of three, of which two are followed."""
    tracker = ContactTracker(FLAT, AT_ONCE, max_contacts=2)
    places = {(0, 0): 20, (0, 1): 20, (0, 2): 20, (2, 0): 30, (2, 2): 40}
    contacts = tracker.push(pressed(FLAT, 0.0, places))
    assert sorted(contact.region.peak for contact in contacts) == [30, 40]


def test_a_contact_ends_after_a_time_without_any_taxel():
    """A taxel at the threshold (10 counts here) is not in contact."""
    peaks = [25, 25, 0, 0, 25, 10, 0, 0, 30, 30]
    assert follow(peaks, layout=replace(FLAT, release_s=0.03)) == [
        (0.0, [25, 25, 0, 0, 25, 0, 0, 0], True),
        (0.08, [30, 30], False),
    ]


@pytest.mark.parametrize(("away_s", "contacts"), [(0.05, 1), (0.29, 1), (0.3, 2)])
@pytest.mark.parametrize(("dt", "start"), [(0.01, 0.07), (0.0025, 0.07), (0.01, 1.7e9)])
def test_an_arm_that_bounces_touches_once_and_two_quick_taps_are_two(
    away_s, contacts, dt, start
):
    """At any rate and on any clock: the end is a time, not a number of frames."""
    away = round(away_s / dt)
    tap = [30] * round(0.1 / dt)
    assert len(follow([*tap, *[0] * away, *tap], dt=dt, start=start)) == contacts


def test_nothing_is_kept_beyond_the_horizon():
    # One frame past it, to interpolate up to it.
    assert follow([30] * 20, horizon_s=0.055) == [(0.0, [30] * 7, False)]


def test_a_reading_without_contact_replaces_none_of_its_instant():
    taxels = [(0.0, {(1, 1): 50}), (0.0, {(1, 3): 50}), (0.0, {}), (0.01, {(1, 4): 50})]
    frames = [pressed(FLAT, t, pressed_taxels) for t, pressed_taxels in taxels]
    series = followed(FLAT, frames, AT_ONCE).series()
    assert series.area.tolist() == [1, 1]
    assert series.motion == pytest.approx([0.0, 0.01], abs=1e-16)


def test_motion_on_a_flat_skin_and_its_last_value_after_the_end():
    places = [{(1, 1): 50}, {(1, 2): 50}, {(2, 4): 50}, {}, {}]
    frames = [pressed(FLAT, i * 0.01, taxels) for i, taxels in enumerate(places)]
    series = followed(replace(FLAT, release_s=0.02), frames).series()
    far = np.hypot(0.01, 0.03)
    assert series.motion == pytest.approx([0.0, 0.01, far, far, far], abs=1e-16)
    assert series.area.tolist() == [1, 1, 1, 0, 0]
    assert series.sums.tolist() == [[1, 1], [1, 2], [2, 4], [0, 0], [0, 0]]
    assert series.ended


TURN = Chain([Joint("turn", (0.0, 0.0, 1.0))])


def turning(angles):
    """A region that stays on the skin, while the arm turns."""
    joints = [None if angle is None else np.array([angle]) for angle in angles]
    return [
        pressed(FLAT, i * 0.01, {(0, 2): 50}, joints=q) for i, q in enumerate(joints)
    ]


def test_motion_in_the_world_follows_the_joints_and_has_a_gap_without_a_pose():
    """A region that stays on the skin moves in the world as its link does."""
    layout = replace(FLAT, pitch_m=0.1)  # at x = 0.2 m from the axis
    angles = [None, 0.0, 0.5, None, np.pi]
    contact = followed(layout, turning(angles), chain=TURN)
    motion = contact.series().motion
    assert np.isnan(motion).tolist() == [angle is None for angle in angles]
    far = [0.0, 2 * 0.2 * np.sin(0.25), 0.4]
    assert motion[[1, 2, 4]] == pytest.approx(far, abs=1e-15)
    assert contact.missing_pose
    assert not followed(layout, turning([0.0, 0.5]), chain=TURN).missing_pose


def test_taxels_that_are_missing_are_flagged_unless_known_to_be_dead():
    valid = np.ones(FLAT.shape, dtype=bool)
    valid[3, 5] = False
    frame = pressed(FLAT, 0.0, {(1, 1): 50}, valid=valid)
    for layout, missing in ((FLAT, True), (replace(FLAT, dead=(23,)), False)):
        contact = followed(layout, [frame], AT_ONCE)
        assert contact.missing_taxels is missing


def test_a_region_has_the_mean_time_of_its_taxels():
    """A frame is a rolling shutter: its chips are read one after another."""
    times = np.zeros(FLAT.shape)
    times[1, (1, 2)] = 0.004, 0.008
    frames = [pressed(FLAT, t, {(1, (1, 2)): 50}, times=t + times) for t in (0.0, 0.02)]
    contact = followed(FLAT, frames, AT_ONCE)
    assert contact.onset_s == pytest.approx(0.006)
    assert contact.series().t == pytest.approx([0.0, 0.02])


def test_frames_of_another_shape_and_time_that_goes_back_are_refused():
    with pytest.raises(InputError, match="on a skin of"):
        followed(FLAT, [pressed(SkinLayout(2, 2), 0.0, {})])
    with pytest.raises(InputError, match="time goes back"):
        followed(FLAT, [pressed(FLAT, t, {}) for t in (1.0, 0.5)])


@pytest.mark.parametrize(
    ("t", "word"),
    [(np.nan, "not finite"), (1.7e12, "give seconds"), (-1e15, "give seconds")],
)
def test_a_time_that_is_not_finite_or_whose_steps_drown_is_refused(t, word):
    """Seconds since 1970 are fine; milliseconds and nanoseconds are not."""
    with pytest.raises(InputError, match=f"time of a frame is .*{word}"):
        followed(FLAT, [pressed(FLAT, t, {})])


@pytest.mark.parametrize("t", [np.nan, -np.inf])
def test_a_taxel_in_contact_has_a_finite_time(t):
    frame = pressed(FLAT, 0.0, {(1, 1): 50}, times=np.full(FLAT.shape, t))
    with pytest.raises(InputError, match="time of a taxel in contact is not finite"):
        followed(FLAT, [frame])


def test_the_first_of_two_contacts_is_given_whole(make_touch, forearm):
    first = make_touch(seconds=0.5)
    touches = in_a_row(first, replace(first, frames=2 * first.frames), rest=30)
    onset_s, series = first_contact(touches, ContactTracker(forearm))
    assert onset_s == 0.2
    assert series.ended
    assert series.peak.max() == first.frames.max()


def test_a_touch_begins_by_an_event_alone_before_it_is_felt():
    tracker = ContactTracker(FLAT, horizon_s=0.5)
    tracker.outside = True
    touched = {*range(10), *range(40, 60)}
    contacts = {}
    for i in range(120):
        taxels = {(3, 3): 200 * (i in touched)}
        frame = pressed(FLAT, 0.01 * i, taxels, onset=i in (20, 100))
        contacts |= dict.fromkeys(tracker.push(frame))
    first, second = contacts
    assert (first.onset_s, second.onset_s) == pytest.approx((0.2, 1.0))
    series = first.series()
    assert series.t[series.area > 0][0] == pytest.approx(0.2)
    assert first.ended
    assert first.touched_s == pytest.approx(0.39)
    assert not second.ended


def test_a_frame_without_shear_is_named():
    with pytest.raises(InputError, match="need shear, which a frame lacks"):
        followed(replace(FLAT, axes=3), [pressed(FLAT, 0.0, {})])


LONG = SkinLayout(rows=6, cols=20, threshold_counts=10, onset_counts=20, release_s=0.05)


MERGED, PARTED = ".######", "##.###"


FLICKER = "/".join(["#." * 10, ".#" * 10] * 3)


@pytest.mark.parametrize(
    ("pictures", "areas", "ended"),
    [
        # Two regions are two contacts, also where the later one is larger.
        (
            ["##", "##", *["##....####"] * 2, "#.....####"],
            [[2, 2, 2, 2, 1], [4, 4, 4]],
            [0, 0],
        ),
        # A region that moves by its width goes on.
        (["#", "#", ".#", "..#", "..#"], [[1] * 5], [0]),
        # Where two grow into one, the older goes on and the other ends.
        (
            [".##", *[".##...##"] * 2, *[MERGED] * 5],
            [[2, 2, 2, 6, 6, 6, 6, 6], [2, 2, 0, 0, 0, 0, 0]],
            [0, 1],
        ),
        # Where one parts in two, the larger share goes on.
        (["######", "######", PARTED, PARTED], [[6, 6, 3, 3], [2, 2]], [0, 0]),
        # A region apart from where a contact was is another one.
        (["##", "##", *["...##"] * 2], [[2, 2, 0, 0], [2, 2]], [0, 0]),
        # A region below the onset count begins nothing.
        (["++", "++", "++"], [], []),
        # A contact ends by itself while another goes on.
        (
            [*["#....##"] * 2, *[".....##"] * 5],
            [[2] * 7, [1, 1, 0, 0, 0, 0, 0]],
            [0, 1],
        ),
        # A skin that flickers has no more than so many contacts.
        ([FLICKER] * 3, [[1] * 3] * MAX_CONTACTS, [0] * MAX_CONTACTS),
    ],
)
def test_each_region_is_a_contact_of_its_own(pictures, areas, ended):
    """Pictures are rows of taxels: '#' has 100 counts, '+' 15, '.' none."""
    tracks = ContactTracker(LONG, max_contacts=MAX_CONTACTS)
    levels = {"#": 100, "+": 15, ".": 0}
    for i, picture in enumerate(pictures):
        counts = np.zeros(LONG.shape, dtype=np.uint16)
        for r, row in enumerate(picture.split("/")):
            counts[r, : len(row)] = [levels[taxel] for taxel in row]
        contacts = list(tracks.push(Frame(i / 100, counts)))
    assert [contact.series().area.tolist() for contact in contacts] == areas
    assert [contact.ended for contact in contacts] == ended


def test_a_place_is_the_centroid_turned_and_moved_by_the_arm():
    layout = replace(LONG, pitch_m=0.01)
    chain = Chain.cody()
    joints = np.array([0.1, -0.2, 0.3, 0.4, -0.5])
    tracks = ContactTracker(layout, chain=chain, max_contacts=2)
    counts = np.zeros(LONG.shape, dtype=np.uint16)
    counts[2, 3:5] = 100
    for i in range(2):
        (*_, contact) = [None, *tracks.push(Frame(i / 100, counts, joints=joints))]
    expected = (chain.pose(joints) @ [0.035, 0.02, 0.0, 1.0])[:3]
    assert contact.position() == pytest.approx(expected, abs=1e-15)
