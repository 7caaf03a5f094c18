"""The exported model as a board loads it, a URDF file, and a process that Ctrl-C interrupts."""

import signal

import pytest

from edge.model.model import Model
from tests.edge.touch.test_urdf import ARM


@pytest.fixture(scope="session")
def model(exported):
    """The exported model, which no test may change."""
    return Model(exported / "model.onnx")


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
