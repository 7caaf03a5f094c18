"""A skin of three axes from the wire to a frame: rest, drift, dead band and
calibration of each axis."""

import numpy as np
import pytest

from edge.errors import InputError
from edge.record.recording import Recording
from edge.touch.layout import SkinLayout, for_device
from edge.wire.fake.player import play, skin_file
from edge.wire.skin.calibration import with_calibration
from edge.wire.skin.file import Signal, parse
from edge.wire.skin.shear import ShearReader, SignedBaseline

LAYOUT = SkinLayout(3, 4, threshold_counts=40, onset_counts=60, axes=3)
PAD = """
[skin]
rows = 3
cols = 4
axes = 3
threshold_counts = 40
[[bus]]
device = 1
kind = "block"
chips = [{ address = 0x28, first = [0, 0], block = [3, 4] }]
"""


def touch(frames=12) -> Recording:
    """A touch whose shear takes every sign and size."""
    rng = np.random.default_rng(4)
    counts = rng.integers(0, 30000, (frames, *LAYOUT.shape)).astype(np.uint16)
    shear = rng.integers(-32767, 32768, (*counts.shape, 2)).astype(np.int16)
    meta = {"skin": LAYOUT.to_dict()}
    return Recording(0.01 * np.arange(frames), counts, meta=meta, shear=shear)


def test_a_recording_played_over_the_wire_arrives_bit_for_bit():
    recording = touch()
    skin, playback = play(skin_file(LAYOUT), recording)
    with skin:
        frames = []
        while skin.clock.now() < playback.ends - 1e-9:
            frames.append(skin.read())
            skin.clock.sleep_until(skin.clock.now() + skin.period_s)
    assert len(frames) == len(recording.t)
    for i, frame in enumerate(frames):
        assert frame.counts.tobytes() == recording.frames[i].tobytes()
        assert frame.shear.tobytes() == recording.shear[i].tobytes()


def test_an_axis_keeps_its_sign_its_dead_band_and_its_limits():
    signal = Signal(dead_band_counts=5)
    baseline = SignedBaseline(signal, 100.0, [1000, 1000, 0, 65535])
    raw = np.array([1004, 995, 65535, 0], dtype=np.uint16)
    assert baseline.away(raw).tolist() == [0, -5, 32767, -32767]


def test_a_taxel_that_is_not_valid_has_no_shear():
    skin, _ = play(skin_file(LAYOUT), touch())
    with skin:
        skin.read()
        shear = skin.shear.read(np.arange(12) != 5, settled=False)
    assert not shear.reshape(12, 2)[5].any()
    assert shear.reshape(12, 2)[[4, 6]].any()


def test_shear_is_counted_from_the_calibrated_rest_values_beyond_their_noise():
    every = np.ones(12, dtype=bool)
    skin, _ = play(skin_file(LAYOUT), touch())
    with skin:
        shear = skin.read().shear.astype(int)
        calibration = skin.file.calibration
        calibration.shear_baseline[:] = (1 << 15) - 2768
        calibration.shear_noise[0, 0] = 1e6
        again = ShearReader(skin.file, skin._decoder.rows).read(every, settled=False)
    expected = np.minimum(shear + 2768, 32767)
    expected[0, 0] = 0
    assert again.tolist() == expected.tolist()


def test_a_calibration_of_three_axes_is_written_and_read_back():
    skin, _ = play(skin_file(LAYOUT), touch())
    with skin:
        calibration = skin.file.calibration
    calibration.shear_baseline[1, 2] = 30000, 40000
    calibration.shear_noise[0, 3] = 0.25, 1.5
    back = parse(with_calibration(PAD, calibration)).calibration
    assert back.shear_baseline.tolist() == calibration.shear_baseline.tolist()
    assert back.shear_noise.tolist() == calibration.shear_noise.tolist()
    assert back.baseline.tolist() == calibration.baseline.tolist()


def test_a_calibration_of_one_axis_does_not_do_for_three():
    single = PAD + "[calibration]\nbaseline = BASE\nnoise = BASE\n"
    text = single.replace("BASE", str([[0] * 4] * 3))
    with pytest.raises(InputError, match="shear_baseline must be 3 rows of 4 pairs"):
        parse(text)


def test_a_model_that_needs_shear_is_refused_on_a_skin_without_it():
    plain = SkinLayout(3, 4, threshold_counts=40)
    with pytest.raises(InputError, match="needs shear, which this skin does not give"):
        for_device(LAYOUT, plain)
