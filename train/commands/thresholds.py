"""Propose thresholds from the recordings' own noise.

Takes the first 0.1 s of each recording for noise, proposes a threshold 2 times above the level that
one in ten recordings exceeds and an onset 1.5 times above that, and says how many contacts other
thresholds find.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence

import numpy as np
from tqdm import tqdm

from edge.errors import InputError
from edge.recording import Recording
from edge.touch.layout import for_device
from edge.touch.track import ContactTracker
from train.dataset import contacts, read, with_thresholds

QUIET_S = 0.1
"""Taken as before the contact, from the start of each recording."""
MARGIN = 2.0
"""The threshold lies so many times above the largest noise."""
ONSET = 1.5
"""The onset lies so many times above the threshold, so that a force that hovers is one contact."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("data", nargs="+", help=".npz recordings or folders of them")


def proposed(recordings: Sequence[Recording]) -> tuple[int, int]:
    """Threshold and onset in counts, from the noise before contact.

    The level is the 90th percentile over the recordings of the largest count in their first
    `QUIET_S`: a few recordings that begin in contact do not raise it.
    """
    largest = [
        int(recording.frames[recording.t <= recording.t[0] + QUIET_S].max(initial=0))
        for recording in recordings
    ]
    threshold = max(round(MARGIN * float(np.quantile(largest, 0.9))), 1)
    return min(threshold, 65534), min(round(ONSET * threshold), 65534)


def found(recordings: Sequence[Recording], threshold: int, onset: int) -> tuple[int, int]:
    """How many recordings have a contact, and how many contacts there are."""
    layout = with_thresholds(recordings[0].layout, threshold, onset)
    counts = [
        len(
            contacts(recording, ContactTracker(for_device(layout, recording.layout), horizon_s=0.1))
        )
        for recording in recordings
    ]
    return sum(count > 0 for count in counts), sum(counts)


def run(arguments: argparse.Namespace) -> int:
    """Propose, and count."""
    recordings = read(arguments.data, progress=True).recordings
    if any(len(recording.t) == 0 for recording in recordings):
        raise InputError("a recording has no frame; leave it out")
    threshold, onset = proposed(recordings)
    own = recordings[0].layout
    rows = [("recorded", own.threshold_counts, own.onset)]
    rows += [
        (name, min(round(factor * threshold), 65534), min(round(factor * onset), 65534))
        for name, factor in (("half", 0.5), ("proposed", 1.0), ("twice", 2.0), ("four times", 4.0))
    ]
    print(f"{'':<11}threshold  onset  recordings with a contact  contacts")
    for name, low, high in tqdm(rows, desc="following", leave=False):
        some, every = found(recordings, low, high)
        tqdm.write(
            f"{name:<11}{low:>9}  {high:>5}  {some:>12} of {len(recordings):<10}  {every:>8}"
        )
    print(f"use: --threshold {threshold} --onset {onset}")
    return 0
