"""sd_notify(3) as its receiver sees it."""

import os
import socket

import pytest

from edge.app.sinks.systemd import Notifier
from edge.wire.fake.clock import VirtualClock


@pytest.fixture
def clock():
    return VirtualClock(start=100.0)


@pytest.fixture
def notifier(manager, clock):
    """Make a notifier that has the manager's socket."""

    def make(**environment):
        environment = {"NOTIFY_SOCKET": manager.getsockname(), **environment}
        return Notifier(environment, now=clock.now)

    return make


def messages(listener):
    listener.setblocking(False)
    lines = []
    while True:
        try:
            lines.append(listener.recv(4096).decode())
        except BlockingIOError:
            return lines


def test_a_sign_of_life_goes_out_twice_in_the_time_allowed_however_often_it_is_given(
    manager,
    clock,
    notifier,
):
    service = notifier(WATCHDOG_USEC="10000000", WATCHDOG_PID=str(os.getpid()))
    for tick in range(2001):  # 20 s at 100 Hz
        clock.sleep_until(100.0 + tick / 100)
        service.push(None, [])
    assert messages(manager) == ["WATCHDOG=1"] * 5


def test_a_name_in_the_abstract_namespace(clock):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        name = f"edge-classify-{os.getpid()}"
        listener.bind("\0" + name)
        Notifier({"NOTIFY_SOCKET": "@" + name}, now=clock.now).ready()
        assert listener.recv(64) == b"READY=1"


@pytest.mark.parametrize(
    "environment",
    [
        {},
        {"WATCHDOG_USEC": "soon"},
        {"WATCHDOG_USEC": "10000000", "WATCHDOG_PID": "1"},
    ],
)
def test_nobody_watches(manager, clock, notifier, environment):
    service = notifier(**environment)
    service.push(None, [])
    clock.sleep_until(1100.0)
    service.push(None, [])
    assert messages(manager) == []


@pytest.mark.parametrize("address", ["", "relative"])
def test_without_a_manager_no_socket_is_opened(notifier, address, monkeypatch):
    service = notifier(NOTIFY_SOCKET=address, WATCHDOG_USEC="1")
    opened = []
    monkeypatch.setattr(socket, "socket", lambda *kind: opened.append(kind))
    service.ready()
    service.push(None, [])
    service.close()
    assert opened == []


def test_a_manager_that_does_not_listen_does_not_hold_up_the_loop(manager, notifier):
    service = notifier()
    for _ in range(10_000):  # far more than a socket's queue takes
        service.close()
    assert 1 <= len(messages(manager)) < 10_000
