"""Thresholds: those that a skin's own noise suggests, and lower ones where touches are
missed."""

from collections.abc import Callable, Sequence

import numpy as np

from edge.recording import Recording
from edge.touch.layout import for_device
from edge.touch.still import WatchfulTracker
from edge.touch.thresholds import MARGIN, above, noise
from train.dataset import DataSet, contacts, with_thresholds
from train.labels import NO_CONTACT

MARGINS = (MARGIN, 1.0)
"""Ratios of the threshold to the noise: the lower one where touches are missed at the
other."""
MISSED_SHARE = 0.02
"""Of the touches, which a proposal may miss."""
LOWER = (0.5, 0.25, 0.0)
"""Parts of the recorded thresholds that are tried where touches are missed."""
FEWEST_GAINED = 1.5
"""Recordings that lower thresholds must decide right more often."""


def proposed(recordings: Sequence[Recording]) -> tuple[int, int]:
    """Threshold and onset in counts, from the noise before contact.

    The noise is the 90th percentile over the recordings of
    `edge.touch.thresholds.noise`, so that a few recordings that begin in contact do not
    raise it. The threshold is twice the noise, or as high as the noise where that
    misses more of the recordings labelled with a touch.
    """
    largest = [noise(recording.t, recording.frames) for recording in recordings]
    pairs = [above(float(np.quantile(largest, 0.9)), margin) for margin in MARGINS]
    labelled = [
        r for r in recordings if r.labels and NO_CONTACT not in r.labels.values()
    ]
    if not labelled:
        return pairs[0]
    high, low = (count_contacts(labelled, *pair)[0] for pair in pairs)
    return pairs[high < (1.0 - MISSED_SHARE) * low]


def count_contacts(
    recordings: Sequence[Recording], threshold: int, onset: int
) -> tuple[int, int]:
    """The number of recordings with a contact, and the number of contacts."""
    layout = with_thresholds(recordings[0].layout, threshold, onset)
    counts = []
    for recording in recordings:
        tracker = WatchfulTracker(for_device(layout, recording.layout), horizon_s=0.1)
        counts.append(len(contacts(recording, tracker)))
    return len(np.flatnonzero(counts)), sum(counts)


def chosen(
    dataset: DataSet,
    load: Callable[[int, int], DataSet],
    accuracy: Callable[[DataSet], float],
) -> tuple[DataSet, list[str]]:
    """The data set at the thresholds whose decisions are most accurate, and sentences
    that say so.

    Lower ones are tried where a recording that is labelled with a touch shows none.
    They are taken where they gain more than a standard error and a single recording, as
    they find a contact in any noise. Of equally accurate ones the highest are taken.

    Args:
        dataset: at the recorded thresholds.
        load: the data set at a threshold and an onset.
        accuracy: of decisions on a data set, where missed touches count as wrong.
    """
    unfelt = sum(NO_CONTACT not in labels.values() for _, labels in dataset.untouched)
    own = dataset.layout.threshold_counts, dataset.layout.onset
    levels = dict.fromkeys(
        (round(part * own[0]), round(part * own[1])) for part in LOWER
    )
    if not unfelt or own[1] == 0:
        return dataset, []
    tried = [dataset, *(load(*level) for level in levels if level != own)]
    shares = [accuracy(candidate) for candidate in tried]
    best = int(np.argmax(shares))
    n = len(dataset.trials) + len(dataset.untouched)
    error = np.sqrt(n * shares[0] * (1.0 - shares[0]))
    if n * (shares[best] - shares[0]) <= max(error, FEWEST_GAINED):
        return dataset, []
    layout = tried[best].layout
    return tried[best], [
        f"the threshold is {layout.threshold_counts} and the onset {layout.onset} "
        "counts: at "
        f"{own[0]} and {own[1]} counts, {unfelt} recordings show no contact; in "
        "cross-validation "
        f"{shares[best]:.1%} against {shares[0]:.1%} (--threshold and --onset set them)"
    ]
