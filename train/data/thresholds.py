"""Thresholds: those that a skin's own noise suggests, and lower ones where touches are
missed."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import filterfalse

import numpy as np

from edge.record.recording import Recording
from edge.record.thresholds import MARGIN, QUIET_S, above, noise
from edge.touch.layout import for_device
from edge.touch.track import DEBOUNCE, ContactTracker
from train.data.contacts import contacts, with_thresholds
from train.data.labels import NO_CONTACT

MARGINS = (MARGIN, 1.0)
"""Ratios of the threshold to the noise: the lower one where touches are missed at the
other."""
MISSED_SHARE = 0.02
"""Of the touches, which a proposal may miss."""
FELT_SHARE = 0.05
"""Of the recordings labelled with a touch; fewer contacts mean that the noise was none."""
BEGUN_RATIO = 3.0
BEGUN_SHARE = 0.2
"""A recording begins in contact if a count of its first frames is above three times the
median taxel, and above a fifth of its highest count."""
QUIETEST = 0.2


@dataclass(frozen=True)
class Proposal:
    """Thresholds that suit the noise of some recordings.

    Attributes:
        threshold, onset: in counts.
        source: where they come from, as the end of a sentence.
    """

    threshold: int
    onset: int
    source: str


def proposed(recordings: Sequence[Recording]) -> Proposal:
    """Thresholds from the noise before contact.

    The noise is the 90th percentile of `edge.record.thresholds.noise` over the
    recordings that do not begin in contact. The threshold is twice the noise, or as
    high as the noise where that misses more of the recordings labelled with a touch.
    Where no recording has an untouched part, the threshold is the level of the quietest
    taxels, or 0 where that misses touches.
    """
    labelled = list(filter(_is_touch, recordings))
    untouched = list(filterfalse(begins_in_contact, recordings))
    begun = len(recordings) - len(untouched)
    pair = _above_noise(untouched, labelled) if untouched else None
    if pair is not None:
        source = "the noise before contact"
        if begun:
            source += f" ({begun} of {len(recordings)} begin in contact and give none)"
        return Proposal(*pair, source)
    level = float(np.median(list(map(_quietest, recordings))))
    pair = above(level, 1.0)
    touched = labelled or recordings
    if count_felt(touched, pair[1]) >= (1.0 - MISSED_SHARE) * len(touched):
        source = "the quietest taxels, as no recording has a part without contact"
        return Proposal(*pair, source)
    source = "no recording has a part without contact"
    return Proposal(0, 0, source)


def _is_touch(recording: Recording) -> bool:
    """Whether a recording is labelled with a touch."""
    return bool(recording.labels) and NO_CONTACT not in recording.labels.values()


def _above_noise(
    untouched: Sequence[Recording], labelled: Sequence[Recording]
) -> tuple[int, int] | None:
    """Threshold and onset above the noise of recordings that begin untouched; None
    where even the lower ones miss most of the recordings labelled with a touch."""
    levels = [noise(recording.t, recording.frames) for recording in untouched]
    level = float(np.quantile(levels, 0.9))
    usual, lower = (above(level, margin) for margin in MARGINS)
    if not labelled:
        return usual
    high = count_felt(labelled, usual[1])
    low = count_felt(labelled, lower[1])
    if low < FELT_SHARE * len(labelled):
        return None
    return lower if high < (1.0 - MISSED_SHARE) * low else usual


def count_felt(recordings: Sequence[Recording], onset: int) -> int:
    """The number of recordings with a contact, by a pass over their peaks.

    A region's peak is nearly always the frame's, so `count_contacts` seldom differs.
    """
    felt = 0
    for recording in recordings:
        peaks = recording.frames.reshape(len(recording.t), -1).max(axis=1)
        above_onset = peaks > onset
        for _ in range(DEBOUNCE - 1):
            above_onset = above_onset[1:] & above_onset[:-1]
        felt += bool(above_onset.any())
    return felt


def begins_in_contact(recording: Recording) -> bool:
    """Whether the first frames stand out, from most taxels and against the rest of the
    recording."""
    start = recording.frames[recording.t < recording.t[0] + QUIET_S]
    by_taxel = start.max(axis=0)
    highest = int(by_taxel.max(initial=0))
    stands_out = highest > BEGUN_RATIO * float(np.median(by_taxel))
    return stands_out and highest > BEGUN_SHARE * int(recording.frames.max())


def _quietest(recording: Recording) -> float:
    """The level below which the quietest fifth of the taxels stay half of the time."""
    return float(np.quantile(np.median(recording.frames, axis=0), QUIETEST))


def count_contacts(
    recordings: Sequence[Recording],
    threshold: int,
    onset: int,
) -> tuple[int, int]:
    """The number of recordings with a contact, and the number of contacts."""
    layout = with_thresholds(recordings[0].layout, threshold, onset)
    counts = []
    for recording in recordings:
        tracker = ContactTracker(for_device(layout, recording.layout), horizon_s=0.1)
        counts.append(len(contacts(recording, tracker)))
    return len(np.flatnonzero(counts)), sum(counts)
