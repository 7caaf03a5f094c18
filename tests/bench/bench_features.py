"""What each set of features costs: a frame in contact, and the vector at the end."""

import pytest

from edge.demo import FOLDER
from edge.recording import load
from edge.touch.arm import Chain
from edge.touch.features import WINDOW_S, feature_vector
from edge.touch.track import ContactTracker, first_contact
from train.feature_sets import SETS


@pytest.mark.parametrize("name", [name for name in SETS if "kernels" not in name])
def bench_features(against, note, name):
    features, recording = SETS[name], load(FOLDER / "pillow-movable.npz")
    arm = {"chain": Chain.cody(), "joints": recording.joints.shape[1]}

    def tracker():
        return ContactTracker(recording.layout, features=features, **arm)

    onset_s, series = first_contact(recording, tracker())
    frames = [frame for frame in recording if frame.t >= onset_s]

    def follow():
        tracked = tracker()
        for frame in frames:
            tracked.push(frame)

    followed_s = against(follow, {}, calls=1) / len(frames)
    vector_s = against(lambda: feature_vector(series, WINDOW_S, features=features), {})
    note(
        f"a 10 ms frame, at {followed_s * 1e6:.0f} us",
        followed_s / 0.010,
        "at most 0.02",
    )
    note("a vector, beside a millisecond", vector_s * 1e3, "below 1")
