"""Signs that an accuracy will not hold in use: recordings that are copies, first frames
that tell labels, and recordings that begin in contact."""

import hashlib
from pathlib import Path

import numpy as np
from scipy.spatial.distance import cdist

from train.data.contacts import Trial
from train.data.dataset import DataSet, Recordings
from train.data.thresholds import proposed
from train.data.vectors import Labels

LEAK = 0.5
"""Warn of a leak if a nearest neighbour on the first frame beats the majority class by
more than this share of the remainder."""


def without_copies(recordings: Recordings) -> tuple[Recordings, list[str]]:
    """Recordings without copies of others, which would decide them, and a warning where
    there are some. What has other labels, or no counts, is no copy."""
    originals: dict[bytes, Path] = {}
    copied = []
    is_original = []
    for path, recording in zip(recordings.paths, recordings.each(), strict=True):
        sha = hashlib.sha256(recording.t.tobytes())
        sha.update(recording.frames.tobytes())
        sha.update(repr(sorted(recording.labels.items())).encode())
        original = originals.setdefault(sha.digest(), path)
        is_original.append(original is path or not recording.frames.any())
        if not is_original[-1]:
            copied.append(f"{path} of {original}")
    if not copied:
        return recordings, []
    warning = (
        f"warning: {len(copied)} of {len(is_original)} recordings are copies, such as "
        f"{copied[0]}; they are left out, as each would be decided by its original"
    )
    return recordings.part(is_original), [warning]


def is_late(trial: Trial) -> bool:
    """Whether a touch was under way in the first frame, and is not said to begin there."""
    recording = trial.recording
    return bool(trial.onset_s <= recording.t[0] and not recording.onsets_s)


def late_share(dataset: DataSet) -> float:
    """Share of the touches that were under way in their first frame."""
    return float(np.mean([is_late(trial) for trial in dataset.trials]))


def leaks(dataset: DataSet, y: Labels) -> list[str]:
    """Warnings where the first frame gives labels away, or most recordings begin in
    contact."""
    recordings = [t.recording for t in dataset.trials]
    share = late_share(dataset)
    if share > 0.5:
        advice = "record from before the touch"
        onset = dataset.layout.onset
        # A lower one was taken as it decides better.
        is_recorded = onset >= recordings[0].layout.onset
        if is_recorded and proposed(recordings).onset > onset:
            advice += ", or take higher thresholds (`edge-classify thresholds`)"
        return [
            f"warning: {share:.0%} of the touches begin with their "
            f"recording, so their onset is not known; {advice}"
        ]
    untouched = np.array([not is_late(trial) for trial in dataset.trials])
    X = np.stack([recording.frames[0].reshape(-1) for recording in recordings])
    squares = cdist(X[untouched], X[untouched], "sqeuclidean")
    np.fill_diagonal(squares, np.inf)
    notes = []
    for task, all_labels in y.items():
        labelled = np.flatnonzero(all_labels[untouched])
        if len(labelled) < 2:
            continue
        labels = all_labels[untouched][labelled]
        nearest = squares[np.ix_(labelled, labelled)].argmin(axis=1)
        share = float((labels[nearest] == labels).mean())
        _, counts = np.unique(labels, return_counts=True)
        usual = float(counts.max() / len(labels))
        if share > usual + LEAK * (1.0 - usual):
            notes.append(
                f"warning: the first frame alone tells {task} in {share:.0%} of the "
                "trials, before anything is touched. The accuracy holds only where "
                "this is so in use too"
            )
    return notes
