"""Commands as a user runs them, and what they run on."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from edge import recording
from edge.cli import main
from edge.recording import Recording
from edge.skin import file as skinfile


def lines(text):
    return [json.loads(line) for line in text.splitlines()]


@pytest.fixture
def edge(capsys):
    """Run a command; returns status, stdout's lines as JSON, and stderr."""

    def run(*arguments, text=False):
        status = main([str(a) for a in arguments])
        out = capsys.readouterr()
        return status, out.out if text else lines(out.out), out.err

    return run


@pytest.fixture
def skin(tmp_path):
    path = tmp_path / "skin.toml"
    shutil.copy(skinfile.shipped("cody"), path)
    return path


@pytest.fixture
def quiet(tmp_path, make_touch):
    """A recording in which nothing touches."""
    trial = make_touch()
    path = tmp_path / "quiet.npz"
    recording.save(path, replace(trial, frames=np.zeros_like(trial.frames)))
    return path


@pytest.fixture
def parted(recordings, tmp_path):
    """A touch and half a second without one, so that a loop of it is many contacts."""
    touch = recording.load(recordings / "hard_1.npz")
    rest = 50
    t = np.concatenate([touch.t, touch.t[-1] + np.arange(1, rest + 1) / 100.0])
    frames = np.concatenate([touch.frames, np.zeros((rest, 16, 24), np.uint16)])
    joints = np.concatenate([touch.joints, np.repeat(touch.joints[-1:], rest, axis=0)])
    path = tmp_path / "parted.npz"
    recording.save(path, Recording(t, frames, joints, meta=touch.meta))
    return path
