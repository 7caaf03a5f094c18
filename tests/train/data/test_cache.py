"""Followed contacts that are kept beside their recordings."""

import logging
from dataclasses import replace

import numpy as np
import pytest

from edge.record.recording import load
from edge.record.saving import save
from tests.conftest import touch
from train.data import cache, contacts
from train.data.dataset import Measurement, load_trials

MEASURED = Measurement(("max_force", "skin_force", "contact_motion"))


@pytest.fixture
def folder(tmp_path):
    """Three recordings."""
    for seed in range(3):
        save(tmp_path / f"{seed}.npz", touch(seed=seed))
    return tmp_path


@pytest.fixture
def vectors(folder, monkeypatch):
    """Measures the trials of the folder; gives how many were followed, and the bits of
    their features."""
    followed = []
    follow = contacts.contacts
    monkeypatch.setattr(
        contacts, "contacts", lambda *how: followed.append(1) or follow(*how)
    )

    def measure(measurement=MEASURED):
        followed.clear()
        trials = load_trials([folder], measurement, cached=True)
        return len(followed), trials.features().tobytes()

    return measure


def entries(folder):
    """The files of the cache."""
    return [path for path in (folder / cache.FOLDER).rglob("*") if path.is_file()]


def test_the_same_recordings_are_followed_once(folder, vectors):
    count, bits = vectors()
    assert (count, len(entries(folder))) == (3, 3)
    assert vectors() == (0, bits)
    assert load_trials([folder], MEASURED).features().tobytes() == bits


def test_what_would_differ_is_followed_anew(folder, vectors, monkeypatch):
    vectors()
    recording = load(folder / "1.npz")
    save(folder / "1.npz", replace(recording, frames=recording.frames + np.uint16(1)))
    assert vectors()[0] == 1
    recording = load(folder / "2.npz")
    recording.meta["onset"] = {"source": "first", "times_s": [0.0]}
    save(folder / "2.npz", recording)
    assert vectors()[0] == 1
    assert vectors(replace(MEASURED, threshold=9))[0] == 3
    assert vectors(replace(MEASURED, horizon_s=0.5))[0] == 3
    assert vectors(Measurement(("contact_area",)))[0] == 3
    monkeypatch.setattr(cache, "_version", lambda: "another")
    assert vectors()[0] == 3
    assert len(entries(folder)) == 3


def test_a_damaged_entry_is_followed_anew(folder, vectors):
    _, bits = vectors()
    for entry, size in zip(entries(folder), (0, 99, 2000), strict=True):
        entry.write_bytes(entry.read_bytes()[:size])
    assert vectors() == (3, bits)
    assert vectors() == (0, bits)


def test_a_folder_that_cannot_be_written_does_without(folder, vectors, caplog):
    (folder / cache.FOLDER).write_text("no folder")
    with caplog.at_level(logging.DEBUG, "train"):
        count, _ = vectors()
    assert count == 3
    assert str(folder) in caplog.text
