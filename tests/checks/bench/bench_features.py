"""What each set of features costs: a frame in contact, and the vector at the end."""

from functools import partial

import pytest

from edge.demo import FOLDER
from edge.features.kernels import BIASES, kernel_channels
from edge.features.names import measures
from edge.features.vector import WINDOW_S, feature_vector
from edge.record.recording import load
from edge.touch.arm import Chain
from edge.touch.track import ContactTracker, first_contact
from train.data.feature_sets import SETS
from train.data.kernels import kernel_table

WHOLE = "moments contact kernels zone_kernels joints"
"""Sets that the default model may take together."""
NUMBERS = dict(zip(("taxel_kernels", "zone_kernels"), BIASES, strict=True))


def together(names):
    """The features of some sets."""
    return [feature for name in names.split() for feature in SETS[name]]


def tracker(recording, features):
    layout = recording.layout
    measured = measures(layout, features, recording.joints.shape[1])
    return ContactTracker(layout, chain=Chain.cody(), measures=measured)


@pytest.mark.parametrize(
    "names", [*(name for name in SETS if "shear" not in name), WHOLE]
)
def bench_features(against, note, names):
    features = together(names)
    recording = load(FOLDER / "pillow-movable.npz")
    onset_s, series = first_contact(recording, tracker(recording, features))
    felt = series.felt(WINDOW_S)
    tables = {
        name: kernel_table(
            [kernel_channels(felt, WINDOW_S, name)],
            biases,
            name == "taxel_kernels",
        )
        for name, biases in NUMBERS.items()
        if name in features
    }
    frames = [frame for frame in recording if frame.t >= onset_s]

    def follow():
        followed = tracker(recording, features)
        for frame in frames:
            followed.push(frame)

    followed_s = against(follow, {}, calls=1) / len(frames)
    vector = partial(feature_vector, series, WINDOW_S, features=features, tables=tables)
    vector_s = against(vector, {})
    note(
        f"a 10 ms frame, at {followed_s * 1e6:.0f} us",
        followed_s / 0.010,
        "at most 0.02",
    )
    note("a vector, beside a millisecond", vector_s * 1e3, "below 1")
