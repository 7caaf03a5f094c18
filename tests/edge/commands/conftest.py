"""What commands run on."""

import shutil

import pytest

from edge import recording
from edge.skin import file as skinfile
from tests.conftest import in_a_row


@pytest.fixture
def skin(tmp_path):
    path = tmp_path / "skin.toml"
    shutil.copy(skinfile.shipped("cody"), path)
    return path


@pytest.fixture
def quiet(tmp_path, make_touch):
    """A recording in which nothing touches."""
    path = tmp_path / "quiet.npz"
    recording.save(path, make_touch(lead_s=1.8, seconds=0.0))
    return path


@pytest.fixture
def parted(recordings, tmp_path):
    """A touch and half a second without one, so that a loop of it is many contacts."""
    path = tmp_path / "parted.npz"
    recording.save(path, in_a_row(recording.load(recordings / "hard_1.npz")))
    return path
