"""A recording on fake chips: what goes in at the registers comes out as frames."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from edge.errors import InputError
from edge.record.recording import Recording
from edge.wire.fake.clock import PacedClock
from edge.wire.fake.player import Playback, play, skin_file
from edge.wire.skin import file as skinfile
from edge.wire.skin.loop import Loop


def noise(shape, top=65536):
    rng = np.random.default_rng(sum(shape))
    frames = rng.integers(0, top, (20, *shape), dtype=np.uint16)
    return Recording(np.arange(20) / 100.0, frames)


@pytest.mark.parametrize("shape", [(16, 24), (13, 6), (1, 1), (100, 90)])
def test_a_skin_of_any_shape_gives_back_its_recording(shape):
    """Cody's chips where the shape is Cody's, else microcontrollers; 9000 taxels take
    three."""
    recording = noise(shape, top=40000)
    skin, playback = play(skin_file(recording.layout), recording)
    with skin:
        frames = [frame.counts for frame in Loop(skin, lasts_s=playback.ends).frames()]
    np.testing.assert_array_equal(frames, recording.frames)


def test_a_playback_holds_each_frame_until_the_next_and_can_start_again():
    frames = np.arange(3, dtype=np.uint16).reshape(3, 1, 1)
    recording = Recording(np.array([5.0, 5.01, 5.04]), frames)
    once = Playback(recording)
    looped = Playback(recording, loop=True)
    times = [0.0, 0.0099, 0.01, 0.039, 0.04, 0.9]
    assert [int(once(t)[0, 0]) for t in times] == [0, 0, 1, 1, 2, 2]
    assert once.ends == pytest.approx(0.06)
    assert looped.ends == math.inf
    # The last frame, a pause of 0.6 s without a touch, the first two frames again.
    times = [0.05, 0.061, 0.659, 0.661, 0.671]
    assert [int(looped(t)[0, 0]) for t in times] == [2, 0, 0, 0, 1]


@pytest.fixture
def real(monkeypatch):
    """Real time, which passes as the test says and by sleeping."""
    now = SimpleNamespace(s=1000.0)
    monkeypatch.setattr("edge.wire.fake.clock.time.monotonic", lambda: now.s)
    monkeypatch.setattr(
        "edge.wire.fake.clock.time.sleep", lambda s: setattr(now, "s", now.s + s)
    )
    return now


def test_a_paced_clock_keeps_to_real_time_and_goes_on_without_a_late_loop(
    real,
):
    """It does not hurry after it: what others send at real times would seem to come too
    late."""
    clock = PacedClock()
    real.s += 3.0
    clock.sleep_until(clock.now())
    assert clock.now() == 0.0
    assert clock.real() == 0.0
    clock.sleep_until(0.05)
    assert clock.now() == 0.05
    assert real.s == 1003.05
    real.s += 0.004
    clock.sleep_until(0.05)
    assert clock.now() == 0.05
    real.s += 0.296
    clock.sleep_until(0.06)
    assert clock.now() == pytest.approx(0.35)
    assert clock.real() == pytest.approx(0.35)


def test_a_recording_of_another_shape_is_refused():
    cody = skinfile.load(skinfile.shipped("cody"))
    with pytest.raises(InputError, match="3 x 3 taxels, the skin 'cody forearm' 16"):
        play(cody, noise((3, 3)))
