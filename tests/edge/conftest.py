"""The exported model as a board loads it, and a process that Ctrl-C interrupts."""

import signal

import pytest

from edge.model.model import Model


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
