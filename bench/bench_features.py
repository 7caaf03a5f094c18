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


@pytest.fixture(params=[name for name in SETS if "kernels" not in name])
def features(request):
    """Names of a set's features."""
    return SETS[request.param]


@pytest.fixture
def recording():
    return load(FOLDER / "pillow-movable.npz")


def tracker_of(features, recording):
    joints = recording.joints.shape[1]
    return ContactTracker(recording.layout, chain=Chain.cody(), features=features, joints=joints)


def bench_following(against, note, features, recording):
    """A frame in contact."""
    onset_s, _ = first_contact(recording, tracker_of(features, recording))
    frames = [frame for frame in recording if frame.t >= onset_s][:FRAMES]

    def follow():
        tracker = tracker_of(features, recording)
        for frame in frames:
            tracker.push(frame)

    seconds = against(follow, {}, calls=1) / len(frames)
    note(f"a 10 ms frame, at {seconds * 1e6:.0f} us", seconds / FRAME_S, "at most 0.02")


def bench_vector(against, note, features, recording):
    _, series = first_contact(recording, tracker_of(features, recording))
    vector = against(lambda: feature_vector(series, WINDOW_S, features=features), {})
    note("a millisecond", vector * 1e3, "below 1")
