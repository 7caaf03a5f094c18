"""Contacts: onset, following, end; and what a series holds."""

from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from edge.touch.arm import Chain, Joint
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker, TrackSettings, first_contact

FLAT = SkinLayout(4, 6, threshold_counts=10, onset_counts=20, pitch_m=0.01)


def frames(peaks, layout=FLAT, at=(1, 1), dt=0.01, start=0.0):
    for i, peak in enumerate(peaks):
        counts = np.zeros(layout.shape, dtype=np.uint16)
        counts[at] = peak
        yield Frame(t=start + i * dt, counts=counts)


def follow(peaks, settings=None, *, layout=FLAT, dt=0.01, start=0.0, **keywords):
    """The contacts of a stream, each as (onset_s, peaks, ended)."""
    tracker = ContactTracker(layout, settings, **keywords)
    contacts = []
    for frame in frames(peaks, layout, dt=dt, start=start):
        (contact,) = tracker.push(frame) or [None]
        if contact is not None and contact not in contacts:
            contacts.append(contact)
    return [(c.onset_s, c.series().peak.tolist(), c.ended) for c in contacts]


def test_onset_is_the_first_frame_of_the_run_that_confirmed_it():
    assert follow([0, 0, 30, 40, 50]) == [(0.02, [30, 40, 50], False)]


def test_one_frame_alone_begins_no_contact():
    assert follow([0, 30, 0, 30, 0]) == []
    assert follow([0, 30, 0], TrackSettings(debounce=1)) == [(0.01, [30, 0], False)]


def test_a_contact_begins_above_the_upper_threshold_and_lasts_to_the_lower():
    assert follow([15, 15, 20, 20]) == []
    hovering = [25, 25, 15, 25, 12, 15, 15, 15]
    assert follow(hovering) == [(0.0, hovering, False)]


def test_a_contact_ends_after_a_time_without_any_taxel():
    """A taxel at the threshold (10 counts here) is not in contact."""
    peaks = [25, 25, 0, 0, 25, 10, 0, 0, 30, 30]
    assert follow(peaks, layout=replace(FLAT, release_s=0.03)) == [
        (0.0, [25, 25, 0, 0, 25, 0, 0, 0], True),
        (0.08, [30, 30], False),
    ]


@pytest.mark.parametrize(
    ("away_s", "contacts"), [(0.05, 1), (0.2, 1), (0.29, 1), (0.3, 2), (0.35, 2), (0.5, 2)]
)
@pytest.mark.parametrize("dt", [0.01, 0.005, 0.0025])
@pytest.mark.parametrize("start", [0.0, 0.07, 123.456, 1.7e9])
def test_an_arm_that_bounces_touches_once_and_two_quick_taps_are_two(away_s, contacts, dt, start):
    """At any rate and on any clock: the end is a time, not a number of frames."""
    away = round(away_s / dt)
    tap = [30] * round(0.1 / dt)
    assert len(follow([*tap, *[0] * away, *tap], dt=dt, start=start)) == contacts


def test_nothing_is_kept_beyond_the_horizon():
    found = follow([30] * 20, horizon_s=0.055)
    assert found == [(0.0, [30] * 7, False)]  # one frame past it, to interpolate up to it


def test_motion_counts_from_the_reading_that_counts():
    """Where the first instant was read twice, the later reading is the onset's place."""
    tracker = ContactTracker(FLAT, TrackSettings(debounce=1))
    for t, col in [(0.0, 1), (0.0, 3), (0.01, 4)]:
        counts = np.zeros(FLAT.shape, dtype=np.uint16)
        counts[1, col] = 50
        (contact,) = tracker.push(Frame(t, counts)) or [None]
    assert contact.series().motion == pytest.approx([0.0, 0.01], abs=1e-16)


def test_motion_on_a_flat_skin_and_its_last_value_after_the_end():
    tracker = ContactTracker(replace(FLAT, release_s=0.02))
    zones = [(1, 1), (1, 2), (2, 4), None, None]
    for i, place in enumerate(zones):
        counts = np.zeros(FLAT.shape, dtype=np.uint16)
        if place:
            counts[place] = 50
        (contact,) = tracker.push(Frame(i * 0.01, counts)) or [None]
    series = contact.series()
    far = np.hypot(0.01, 0.03)
    assert series.motion == pytest.approx([0.0, 0.01, far, far, far], abs=1e-16)
    assert series.area.tolist() == [1, 1, 1, 0, 0]
    assert series.sums.tolist() == [[1, 1], [1, 2], [2, 4], [0, 0], [0, 0]]
    assert series.ended


def test_motion_in_the_world_follows_the_joints():
    """A region that stays on the skin moves in the world as its link does."""
    layout = replace(FLAT, pitch_m=0.1)
    chain = Chain([Joint("turn", (0.0, 0.0, 1.0))])
    tracker = ContactTracker(layout, chain=chain)
    for i, angle in enumerate([0.0, 0.5, np.pi]):
        counts = np.zeros(layout.shape, dtype=np.uint16)
        counts[0, 2] = 50  # at x = 0.2 m from the axis
        (contact,) = tracker.push(Frame(i * 0.01, counts, joints=np.array([angle]))) or [None]
    expected = [0.0, 2 * 0.2 * np.sin(0.25), 0.4]
    assert contact.series().motion == pytest.approx(expected, abs=1e-15)


def test_a_frame_without_a_pose_leaves_a_gap_in_motion_and_is_flagged():
    chain = Chain([Joint("turn", (0.0, 0.0, 1.0))])
    tracker = ContactTracker(FLAT, chain=chain)
    for i, joints in enumerate([None, np.array([0.0]), None, np.array([np.pi])]):
        counts = np.zeros(FLAT.shape, dtype=np.uint16)
        counts[0, 2] = 50
        (contact,) = tracker.push(Frame(i * 0.01, counts, joints=joints)) or [None]
    motion = contact.series().motion
    assert np.isnan(motion).tolist() == [True, False, True, False]
    assert motion[3] == pytest.approx(0.04)
    assert contact.missing_pose


def test_taxels_that_are_missing_are_flagged_unless_known_to_be_dead():
    counts = np.zeros(FLAT.shape, dtype=np.uint16)
    counts[1, 1] = 50
    valid = np.ones(FLAT.shape, dtype=bool)
    valid[3, 5] = False
    for layout, missing in ((FLAT, True), (replace(FLAT, dead=(23,)), False)):
        tracker = ContactTracker(layout, TrackSettings(debounce=1))
        (contact,) = tracker.push(Frame(0.0, counts, valid))
        assert contact.missing_taxels is missing


def test_a_region_has_the_mean_time_of_its_taxels():
    """A frame is a rolling shutter: its chips are read one after another."""
    tracker = ContactTracker(FLAT, TrackSettings(debounce=1))
    times = np.zeros(FLAT.shape)
    counts = np.zeros(FLAT.shape, dtype=np.uint16)
    counts[1, 1:3] = 50
    for i in range(2):
        times[1, 1], times[1, 2] = i * 0.02 + 0.004, i * 0.02 + 0.008
        (contact,) = tracker.push(Frame(i * 0.02, counts, times=times)) or [None]
    assert contact.onset_s == pytest.approx(0.006)
    assert contact.series().t == pytest.approx([0.0, 0.02])


def test_frames_of_another_shape_and_time_that_goes_back_are_refused():
    tracker = ContactTracker(FLAT)
    with pytest.raises(InputError, match="on a skin of"):
        tracker.push(Frame(0.0, np.zeros((2, 2), dtype=np.uint16)))
    tracker.push(Frame(1.0, np.zeros(FLAT.shape, dtype=np.uint16)))
    with pytest.raises(InputError, match="time goes back"):
        tracker.push(Frame(0.5, np.zeros(FLAT.shape, dtype=np.uint16)))


@pytest.mark.parametrize("t", [np.nan, np.inf, -np.inf])
def test_times_that_are_not_finite_are_refused(t):
    counts = np.full(FLAT.shape, 50, dtype=np.uint16)
    with pytest.raises(InputError, match="time of a frame is not finite"):
        ContactTracker(FLAT).push(Frame(t, counts))
    with pytest.raises(InputError, match="time of a taxel in contact is not finite"):
        ContactTracker(FLAT).push(Frame(0.0, counts, times=np.full(FLAT.shape, t)))


def test_another_scale_brings_the_thresholds_along():
    model = SkinLayout(4, 6, counts_per_newton=1000.0, threshold_counts=100, onset_counts=150)
    device = SkinLayout(4, 6, counts_per_newton=2000.0, threshold_counts=7, dead=(3,))
    adapted = for_device(model, device)
    assert (adapted.threshold_counts, adapted.onset_counts) == (200, 300)
    assert adapted.counts_per_newton == 2000.0
    assert adapted.dead == ()
    finest = for_device(model, replace(device, counts_per_newton=1e6))
    assert (finest.threshold_counts, finest.onset_counts) == (65535, 65535)
    plain = for_device(SkinLayout(4, 6, threshold_counts=100, onset_counts=150), SkinLayout(4, 6))
    assert (plain.threshold_counts, plain.onset_counts) == (100, 150)


@pytest.mark.parametrize(
    ("device", "word"),
    [
        (SkinLayout(5, 6), "5 x 6 taxels, flat.* made for 4 x 6"),
        (SkinLayout(4, 7), "4 x 7"),
        (SkinLayout(4, 6, wraps=True), "closed around"),
        (SkinLayout(4, 6, counts_per_newton=1.0), "forces in newtons"),
        (SkinLayout(4, 6, pitch_m=0.1), "lengths in metres"),
    ],
)
def test_another_skin_is_refused(device, word):
    with pytest.raises(InputError, match=word):
        for_device(SkinLayout(4, 6), device)


def test_the_first_of_two_contacts_is_given_whole(make_touch, forearm):
    one = make_touch(seconds=0.5, arm=False)
    gap = np.zeros((30, *forearm.shape), dtype=np.uint16)
    frames = np.concatenate([one.frames, gap, 2 * one.frames])
    twice = replace(one, t=np.arange(len(frames)) / 100.0, frames=frames)
    onset_s, series = first_contact(twice, ContactTracker(forearm))
    assert onset_s == 0.2
    assert series.ended
    assert series.peak.max() == one.frames.max()


def test_a_recording_without_a_contact_gives_none(make_touch, forearm):
    still = make_touch(seconds=0.0, arm=False)
    assert first_contact(still, ContactTracker(forearm)) is None


def test_a_clock_too_large_for_its_steps_is_refused_and_says_so():
    """Seconds since 1970 are fine; as milliseconds or nanoseconds, steps of a frame drown."""
    counts = np.zeros(FLAT.shape, dtype=np.uint16)
    ContactTracker(FLAT).push(Frame(1.7e9, counts))
    for t in (1.7e12, 1.7e18, -1e15):
        with pytest.raises(InputError, match="give seconds"):
            ContactTracker(FLAT).push(Frame(t, counts))
