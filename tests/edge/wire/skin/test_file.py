"""skin.toml: the shipped files, the sentence for each mistake, and calibration written
into it."""

import math

import numpy as np
import pytest

from edge.errors import InputError
from edge.wire.skin import file as skinfile
from edge.wire.skin.calibration import (
    calibration_text,
    save_calibration,
    with_calibration,
)
from edge.wire.skin.decoder import dead_band
from edge.wire.skin.file import TaxelCalibration
from tests.edge.wire.skin.small import SMALL, mistake, mpr121


def test_cody_is_384_taxels_on_three_buses():
    cody = skinfile.load(skinfile.shipped("cody"))
    assert cody.layout.shape == (16, 24)
    assert cody.layout.wraps
    assert [len(bus.chips) for bus in cody.buses] == [12, 12, 8]
    assert sorted(cody.served) == list(range(384))
    assert {chip.kind.name for chip in cody.chips} == {"ad7147"}


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            "rows = 4",
            "rows = 4\nrwos = 3",
            "unknown key skin.rwos; allowed: name, rows",
        ),
        ("sign = -1", "sign = 0", "signal.sign must be one of 1, -1, not 0"),
        (
            "sign = -1",
            "dead = [[4, 0]]",
            "signal.dead must be [row, col] within 4 x 6, not [4, 0]",
        ),
        (
            "sign = -1",
            "dead_band_sigma = -1",
            "dead_band_sigma must be a number from 0 to 100",
        ),
        (
            "[signal]",
            "[read]\nrate_hz = 0\n[signal]",
            "read.rate_hz must be a number from 0.1",
        ),
        (
            "[signal]",
            "[reed]\n[signal]",
            "unknown key reed; allowed: skin, signal, read, bus, cal",
        ),
    ],
)
def test_a_mistake_is_one_sentence_that_names_file_and_key(old, new, sentence):
    assert sentence in mistake(SMALL.replace(old, new, 1))


def test_labels_to_choose_from_are_read():
    text = SMALL + '[labels]\nobject = ["box", "cup"]\n'
    assert skinfile.parse(text).labels == {"object": ("box", "cup")}


def calibration(seed=0):
    draw = np.random.default_rng(seed)
    baseline = draw.integers(0, 65536, (4, 6)).astype(np.uint16)
    return TaxelCalibration(baseline, np.round(draw.random((4, 6)) * 9, 3))


def same(a, b):
    arrays = (a.baseline, b.baseline), (a.noise, b.noise)
    return all(np.array_equal(*pair) for pair in arrays)


@pytest.mark.parametrize("tail", ["", "\n[read]\nrate_hz = 50.0\n"])
def test_a_calibration_is_written_replaced_and_read_back(tail):
    first = calibration(1)
    second = calibration(2)
    once = with_calibration(SMALL + tail, first)
    # As a user may move it: a calibration in the middle of the file.
    middle = SMALL + calibration_text(first) + tail
    for text in (once, middle, once.rstrip()):
        assert same(skinfile.parse(text).calibration, first)
        twice = with_calibration(text, second)
        file = skinfile.parse(twice)
        assert same(file.calibration, second)
        assert twice.count("[calibration]") == 1
        assert "# a comment that stays" in twice
        assert file.buses == skinfile.parse(SMALL).buses
        assert file.reading == skinfile.parse(SMALL + tail).reading


def test_a_calibration_of_other_chips_is_refused_beyond_what_a_chip_tells():
    most = np.full((3, 4), 1022, np.uint16)
    text = mpr121() + calibration_text(TaxelCalibration(most, np.ones((3, 4))))
    assert skinfile.parse(text).calibration.baseline.max() == 1022
    sentence = mistake(text.replace("1022", "1023", 1))
    assert "calibration.baseline is 1023 for a taxel of a mpr121" in sentence


def test_a_calibration_that_cannot_be_replaced_is_refused():
    inline = "calibration.taken = 2026-01-01T00:00:00Z\n" + SMALL
    with pytest.raises(InputError, match="calibration"):
        with_calibration(inline, calibration())


@pytest.mark.parametrize(
    ("key", "row"),
    [
        ("baseline", [1, 2]),
        ("noise", [math.nan, 1, 1, 1, 1, 1]),
        *(("baseline", [v, 1, 1, 1, 1, 1]) for v in (0.5, -1, 65536)),
    ],
)
def test_a_damaged_calibration_is_refused(key, row):
    rows = {"baseline": [1] * 6, "noise": [1] * 6, key: row}
    text = (
        SMALL
        + "[calibration]\n"
        + "".join(f"{k} = {[v] * 4}\n" for k, v in rows.items())
    )
    assert f"calibration.{key}" in mistake(text)


def test_a_calibration_above_what_its_chips_tell_is_refused():
    """An MPR121 tells 10 bits, of which 1023 is saturated."""
    pad = skinfile.shipped("mpr121").read_text()
    highest = [[1022] * 12] * 8
    for added, sentence in (
        (0, ""),
        (1, "calibration.baseline is 1023 for a taxel of a mpr121"),
    ):
        highest = [[value + added for value in row] for row in highest]
        text = pad + f"[calibration]\nbaseline = {highest}\nnoise = {highest}\n"
        assert (
            sentence in mistake(text) if sentence else skinfile.parse(text).calibration
        )


def test_saving_a_calibration_keeps_the_old_file_and_leaves_a_wrong_one_alone(tmp_path):
    path = tmp_path / "skin.toml"
    wrong = SMALL.replace("sign = -1", "sign = 2")
    path.write_text(wrong)
    with pytest.raises(InputError):
        save_calibration(path, calibration())
    assert [p.name for p in tmp_path.iterdir()] == ["skin.toml"]
    assert path.read_text() == wrong
    path.write_text(SMALL)
    backup = save_calibration(path, calibration(3))
    assert backup.read_text() == SMALL
    assert same(skinfile.load(path).calibration, calibration(3))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["skin.toml", "skin.toml.bak"]


def test_the_dead_band_is_six_sigma_and_never_less_than_one_count():
    file = skinfile.parse(SMALL + calibration_text(calibration(4)))
    noise = file.calibration.noise.ravel()
    expected = np.maximum(1, np.ceil(6 * noise)).astype(int)
    assert dead_band(file.signal, noise).tolist() == expected.tolist()
