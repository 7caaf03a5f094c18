"""The exported model as a board loads it, files of a skin, of touches and of an arm."""

import shutil
import signal

import pytest

from edge.decide.model import Model
from edge.record import recording, saving
from edge.wire.skin import file as skinfile
from tests.conftest import in_a_row
from tests.edge.touch.test_urdf import ARM


@pytest.fixture(scope="session")
def model(exported):
    """The exported model, which no test may change."""
    return Model(exported / "model.onnx")


@pytest.fixture
def refused(edge):
    """Run `edge-classify`, which refuses its input with status 2; returns stderr."""

    def run(*arguments):
        status, _, err = edge(*arguments)
        assert status == 2
        return err

    return run


@pytest.fixture
def interruptible():
    """A shell that runs the tests in the background lets them ignore SIGINT."""
    inherited = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield signal.default_int_handler
    signal.signal(signal.SIGINT, inherited)


@pytest.fixture
def urdf(tmp_path):
    """A file of an arm with two branches."""
    path = tmp_path / "arm.urdf"
    path.write_text(ARM)
    return path


@pytest.fixture
def skin(tmp_path):
    path = tmp_path / "skin.toml"
    shutil.copy(skinfile.shipped("cody"), path)
    return path


@pytest.fixture
def quiet(tmp_path, make_touch):
    """A recording in which nothing touches."""
    path = tmp_path / "quiet.npz"
    saving.save(path, make_touch(lead_s=1.8, seconds=0.0))
    return path


@pytest.fixture
def parted(recordings, tmp_path):
    """A touch and half a second without one, so that a loop of it is many contacts."""
    path = tmp_path / "parted.npz"
    saving.save(path, in_a_row(recording.load(recordings / "hard_1.npz")))
    return path
