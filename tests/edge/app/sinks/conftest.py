"""What a service is started by."""

import socket

import pytest


@pytest.fixture
def manager(tmp_path):
    """A stand-in for systemd's socket."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.settimeout(60.0)
        yield listener
