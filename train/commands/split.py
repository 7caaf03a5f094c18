"""Cut recordings into one for each contact.

Writes each contact of each recording to a file of its own, named after the recording and the
contact's number. The labels are those of meta.contacts, a list of one set of labels for each
contact, or else the recording's.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from edge.errors import InputError
from edge.recording import Recording, save
from edge.touch.track import ContactTracker
from train.dataset import labels_of, read

LEAD_S = 0.25
"""Kept of what lies before a contact, where no other contact does."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("data", nargs="+", help=".npz recordings or folders of them")
    parser.add_argument("--out", required=True, type=Path, help="folder for the recordings")


def run(arguments: argparse.Namespace) -> int:
    """Cut and write."""
    raw = read(arguments.data, progress=True)
    count = 0
    both = list(zip(raw.paths, raw.recordings, strict=True))
    for path, recording in tqdm(both, desc="splitting", unit=" recordings"):
        try:
            parts = split(recording)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        for i, part in enumerate(parts):
            save(arguments.out / f"{path.stem}-{i:02d}.npz", part)
        count += len(parts)
    print(f"{count} recordings in {arguments.out}")
    return 0


def split(recording: Recording) -> list[Recording]:
    """A recording of each contact, from a moment before it to the next one's."""
    tracker = ContactTracker(recording.layout)
    spans: dict[int, list[float]] = {}
    kept = []
    for frame in recording:
        for contact in tracker.push(frame):
            kept.append(contact)  # so that no identity is given twice
            spans.setdefault(id(contact), [contact.onset_s, frame.t])[1] = frame.t
    labels = labels_of(recording, len(spans))
    if len(labels) < len(spans):
        labels = [recording.labels] * len(spans)
    parts, free = [], -np.inf
    for (onset_s, end_s), own in zip(spans.values(), labels, strict=True):
        t = recording.t
        a = int(np.searchsorted(t, max(onset_s - LEAD_S, free), side="right"))
        b = int(np.searchsorted(t, end_s, side="right"))
        meta = {k: v for k, v in recording.meta.items() if k != "contacts"}
        valid = recording.valid
        parts.append(
            replace(
                recording,
                t=t[a:b],
                frames=recording.frames[a:b],
                joints=None if recording.joints is None else recording.joints[a:b],
                valid=valid[a:b] if valid is not None and valid.ndim == 3 else valid,
                meta={**meta, "labels": own},
            )
        )
        free = end_s
    return parts
