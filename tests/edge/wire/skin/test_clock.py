"""The clock of the board never goes back, and a moment that has passed is not waited
for."""

import time

from edge.wire.skin.skin import SystemClock


def test_it_returns_no_sooner_than_it_was_asked_to():
    clock = SystemClock()
    moment = clock.now() + 0.002
    clock.sleep_until(moment)
    assert clock.now() >= moment


def test_a_moment_that_has_passed_is_not_waited_for(monkeypatch):
    clock = SystemClock()
    slept = []
    monkeypatch.setattr(time, "sleep", slept.append)
    clock.sleep_until(clock.now() - 1.0)
    clock.sleep_until(clock.now())
    assert slept == []
