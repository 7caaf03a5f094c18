"""Ticks that do not drift, periods counted in constant memory, a clean stop."""

import gc
import signal

import numpy as np
import pytest

from edge.wire.fake.clock import VirtualClock
from edge.wire.fake.player import still
from edge.wire.skin.loop import STOP_S, Loop, Periods, Schedule, Stop, stop_on
from tests.edge.wire.skin.small import CODY


def test_a_late_tick_moves_no_other_and_those_gone_by_are_counted():
    clock = VirtualClock()
    schedule = Schedule(clock, 0.01)
    due = []
    for k in range(6):
        due.append(round(schedule.wait(Stop()), 9))
        clock.sleep_until(clock.now() + (0.025 if k == 1 else 0.004))
    assert due == [0.0, 0.01, 0.03, 0.04, 0.05, 0.06]
    assert schedule.missed_ticks == 1
    assert schedule.periods.percentile(100) == pytest.approx(0.025, abs=2e-5)


def test_a_tick_that_comes_with_the_next_one_is_left_out():
    clock = VirtualClock()
    schedule = Schedule(clock, 0.25)
    schedule.wait(Stop())
    clock.sleep_until(clock.now() + 0.5)
    assert (schedule.wait(Stop()) - schedule.start, schedule.missed_ticks) == (0.5, 1)


def test_a_long_wait_looks_now_and_then_whether_to_end():
    clock = VirtualClock()
    schedule = Schedule(clock, 1.0)
    schedule.wait(stop := Stop())
    sleeps = []

    def sleep_until(t):
        sleeps.append(t)
        stop.asked = len(sleeps) == 3

    clock.sleep_until = sleep_until
    schedule.wait(stop)
    assert sleeps == pytest.approx([STOP_S, 2 * STOP_S, 3 * STOP_S])


def test_percentiles_are_those_of_the_sorted_periods_to_a_bin():
    draw = np.random.default_rng(1).gamma(4.0, 0.0025, 5000)
    periods = Periods()
    for period in draw:
        periods.add(float(period))
    for percent in (50, 99, 99.9):
        exact = np.sort(draw)[int(np.ceil(5000 * percent / 100)) - 1]
        assert 0.0 < periods.percentile(percent) - exact <= Periods.BIN_S


def test_a_loop_ends_with_its_time_or_when_asked_after_the_frame_at_hand():
    stop = Stop()
    with still(CODY) as skin:
        t = [frame.t for frame in Loop(skin, lasts_s=0.3).frames()]
        np.testing.assert_allclose(t, np.arange(30) * 0.01, atol=1e-12)
        for count, _ in enumerate(Loop(skin, stop=stop).frames(), 1):
            stop.asked = count == 7
    assert count == 7


def test_garbage_collection_leaves_out_the_objects_made_before_the_loop():
    with still(CODY) as skin:
        frozen = [
            gc.get_freeze_count() > 10_000 for _ in Loop(skin, lasts_s=0.02).frames()
        ]
    assert frozen == [True, True]
    assert gc.get_freeze_count() == 0


def test_a_signal_asks_once_and_is_itself_again_afterwards(interruptible):
    with stop_on(signal.SIGINT) as stop:
        signal.raise_signal(signal.SIGINT)
        assert stop.asked
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is interruptible


def test_a_signal_may_come_as_soon_as_it_is_handled(interruptible, monkeypatch):
    handle = signal.signal

    def interrupted(number, handler):
        former = handle(number, handler)
        if handler is not interruptible:
            signal.raise_signal(number)
        return former

    monkeypatch.setattr("edge.wire.skin.loop.signal.signal", interrupted)
    with stop_on(signal.SIGINT) as stop:
        assert stop.asked


def test_joints_are_asked_for_at_the_frames_own_time():
    class Source:
        def at(self, t):
            return np.array([t, -t])

    with still(CODY) as skin:
        for frame in Loop(skin, joints=Source(), lasts_s=0.05).frames():
            assert frame.joints.tolist() == [frame.t, -frame.t]
