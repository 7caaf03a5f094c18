"""What each set of features costs: a frame in contact, and the vector at the end."""

import pytest

from edge.demo import FOLDER
from edge.recording import load
from edge.touch.arm import Chain
from edge.touch.feature_sets import SETS
from edge.touch.features import WINDOW_S, feature_vector
from edge.touch.track import ContactTracker, first_contact

FRAME_S = 0.010
FRAMES = 120


@pytest.fixture(params=SETS)
def one_set(request):
    """Names of a set's features, and a recording of a contact."""
    return SETS[request.param], load(FOLDER / "pillow-movable.npz")


def tracker_of(names, recording):
    joints = recording.joints.shape[1]
    return ContactTracker(recording.layout, chain=Chain.cody(), features=names, joints=joints)


def bench_following(against, note, one_set):
    """A frame in contact."""
    names, recording = one_set
    onset_s, _ = first_contact(recording, tracker_of(names, recording))
    frames = [frame for frame in recording if frame.t >= onset_s][:FRAMES]

    def follow():
        tracker = tracker_of(names, recording)
        for frame in frames:
            tracker.push(frame)

    a_frame = against(follow, {}, calls=1) / len(frames)
    note(f"a 10 ms frame, at {a_frame * 1e6:.0f} us", a_frame / FRAME_S, "at most 0.02")


def bench_vector(against, note, one_set):
    names, recording = one_set
    _, series = first_contact(recording, tracker_of(names, recording))
    vector = against(lambda: feature_vector(series, WINDOW_S, features=names), {})
    note("a millisecond", vector * 1e3, "below 1")
