"""Cut recordings into one for each contact.

Writes each contact of each recording to its own file, named after the recording and the
contact's number. Its labels come from meta.contacts, a list with the labels of each
contact, or else are those of the recording.
"""

import argparse
from pathlib import Path

import numpy as np

from edge.errors import InputError, about
from edge.files import parsing
from edge.recording import Recording
from edge.saving import save
from edge.touch.contact import Contact
from edge.touch.track import ContactTracker
from edge.writing import remove_leftovers
from train import former_recordings
from train.data.dataset import read
from train.data.labels import labels_of
from train.data.parts import part
from train.progress import bar, say

LEAD_S = 0.25
"""Seconds kept before a contact, or fewer where another contact ends in them."""


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add the command's options."""
    parser.add_argument("data", nargs="+", help=".npz recordings or folders of them")
    parser.add_argument(
        "--out",
        required=True,
        type=Path,
        help="folder for the recordings",
    )


def run(arguments: argparse.Namespace) -> int:
    """Cut and write."""
    raw = read(arguments.data, progress=True)
    contacts: dict[Path, Recording] = {}
    pairs = list(zip(raw.paths, raw.recordings, strict=True))
    for path, recording in bar(pairs, desc="splitting", unit=" recordings"):
        with parsing(str(path), "a recording to split"), about(str(path)):
            for i, contact in enumerate(split(recording)):
                file = arguments.out / f"{path.stem}-{i:02d}.npz"
                if file in contacts:
                    raise InputError(
                        f"{file} is that of another recording too; rename one of them"
                    )
                contacts[file] = contact
    remove_leftovers(arguments.out)
    for path, contact in contacts.items():
        save(path, contact)
    print(f"recordings written to {arguments.out}: {len(contacts)}")
    for warning in former_recordings.warnings(arguments.out, contacts):
        say(warning)
    return 0


def split(recording: Recording) -> list[Recording]:
    """A recording of each contact, from `LEAD_S` before its onset to its end."""
    tracker = ContactTracker(recording.layout)
    ends_s: dict[Contact, float] = {}
    for frame in recording:
        ends_s |= dict.fromkeys(tracker.push(frame), frame.t)
    labels = labels_of(recording, len(ends_s))
    if len(labels) < len(ends_s):
        labels = [recording.labels] * len(ends_s)
    meta = {key: value for key, value in recording.meta.items() if key != "contacts"}
    contacts = []
    previous_end_s = -np.inf
    for (contact, end_s), contact_labels in zip(ends_s.items(), labels, strict=True):
        start_s = max(contact.onset_s - LEAD_S, previous_end_s)
        span = slice(*np.searchsorted(recording.t, (start_s, end_s), side="right"))
        of_contact = {**meta, "labels": contact_labels}
        contacts.append(part(recording, span, meta=of_contact))
        previous_end_s = end_s
    return contacts
