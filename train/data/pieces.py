"""Touches that a skin feels in pieces: how long a contact may be away and go on."""

from collections.abc import Callable

from edge.touch.layout import LONGEST_RELEASE_S
from train.data.dataset import DataSet
from train.data.thresholds import FEWEST_GAINED, most_accurate

RELEASES_S = (1.0, 3.0)
"""Seconds that a contact may be away and go on. They are tried where many recordings
have further contacts, and so is the duration of the longest recording."""
MANY_PIECES = 0.1
"""Share of the trials with further contacts from which on longer releases are tried."""


def joined(
    dataset: DataSet,
    load: Callable[[float], DataSet],
    accuracy: Callable[[DataSet], float],
) -> tuple[DataSet, list[str]]:
    """The data set whose contacts last across the gaps that decisions gain from, and
    sentences that say so.

    It is the shortest release that decides about as many touches right as the best. That
    of the skin stays where the gain is less than a standard error or a single recording.
    A board that runs the model follows contacts alike.

    Args:
        dataset: with the release of the skin.
        load: the data set at a release in seconds.
        accuracy: of decisions on a data set.
    """
    present_s = dataset.layout.release_s
    pieces = len(dataset.unused)
    n = len(dataset.trials)
    if pieces < MANY_PIECES * n:
        return dataset, []
    recordings = [trial.recording for trial in dataset.trials]
    longest_s = max(float(recording.t[-1] - recording.t[0]) for recording in recordings)
    end_s = min(round(longest_s + 0.05, 1), LONGEST_RELEASE_S)
    longer_s = [s for s in sorted({*RELEASES_S, end_s}) if present_s < s <= end_s]
    datasets = [dataset, *map(load, longer_s)]
    best, shares = most_accurate(datasets, accuracy)
    if best == 0:
        return dataset, []
    counted = n + len(dataset.untouched)
    near = [counted * (shares[best] - share) <= FEWEST_GAINED for share in shares]
    place = near.index(True)
    release_s = longer_s[place - 1]
    return datasets[place], [
        f"a contact lasts across gaps of up to {release_s:g} s, as {pieces} of {n} "
        "touches are felt in pieces: in cross-validation "
        f"{shares[place]:.1%} against {shares[0]:.1%} with {present_s:g} s (--release "
        "sets it); on the robot let go for longer between two touches"
    ]
