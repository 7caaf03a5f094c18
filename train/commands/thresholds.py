"""Propose thresholds from the recordings' own noise.

Takes the first 0.1 s of each recording as noise. Proposes a threshold of twice the level that one
in ten recordings exceeds, and an onset of 1.5 times that threshold. Counts the contacts that these
and other thresholds give.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from tqdm import tqdm

from edge.recording import Recording
from edge.touch.layout import for_device
from edge.touch.track import ContactTracker
from train.dataset import contacts, read, with_thresholds
from train.progress import bar

QUIET_S = 0.1
"""The time from the start of each recording that is taken to lie before the contact."""
MARGIN = 2.0
"""Ratio of the threshold to the noise."""
ONSET = 1.5
"""Ratio of the onset to the threshold, so that a force that fluctuates is one contact."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("data", nargs="+", help=".npz recordings or folders of them")


def proposed(recordings: Sequence[Recording]) -> tuple[int, int]:
    """Threshold and onset in counts, from the noise before contact.

    The noise is the 90th percentile over the recordings of the largest count in their first
    `QUIET_S`, so that a few recordings that begin in contact do not raise it.
    """
    largest = [
        int(recording.frames[recording.t <= recording.t[0] + QUIET_S].max(initial=0))
        for recording in recordings
    ]
    threshold = max(round(MARGIN * float(np.quantile(largest, 0.9))), 1)
    return min(threshold, 65534), min(round(ONSET * threshold), 65534)


def count_contacts(recordings: Sequence[Recording], threshold: int, onset: int) -> tuple[int, int]:
    """The number of recordings with a contact, and the number of contacts."""
    layout = with_thresholds(recordings[0].layout, threshold, onset)
    counts = []
    for recording in recordings:
        tracker = ContactTracker(for_device(layout, recording.layout), horizon_s=0.1)
        counts.append(len(contacts(recording, tracker)))
    return len(np.flatnonzero(counts)), sum(counts)


def run(arguments: argparse.Namespace) -> int:
    """Print the proposal, and the contacts that it and other thresholds give."""
    recordings = read(arguments.data, progress=True).recordings
    threshold, onset = proposed(recordings)
    own = recordings[0].layout
    rows = [("recorded", own.threshold_counts, own.onset)]
    for name, factor in (("half", 0.5), ("proposed", 1), ("twice", 2), ("four times", 4)):
        low, high = (min(round(factor * level), 65534) for level in (threshold, onset))
        rows.append((name, low, high))
    print(f"{'':<11}threshold  onset  recordings with a contact  contacts")
    for name, low, high in bar(rows, desc="following", leave=False):
        touched, total = count_contacts(recordings, low, high)
        tqdm.write(
            f"{name:<11}{low:>9}  {high:>5}  {touched:>12} of {len(recordings):<10}  {total:>8}"
        )
    print(f"use: --threshold {threshold} --onset {onset}")
    return 0
