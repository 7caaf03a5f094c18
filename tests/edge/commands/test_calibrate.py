"""`edge-classify calibrate`: exact means and deviations, and a skin that must be at
rest."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge import recording, saving
from edge.commands import calibrate
from edge.commands.calibrate import (
    NOISY,
    NOISY_COUNTS,
    Sums,
    measure,
    noisiest_taxels,
    standing_out,
    unusable,
)
from edge.commands.options import NOISE_COUNTS
from edge.fake.touches import still
from edge.skin import file as skinfile
from edge.skin.decoder import dead_band


def test_a_taxel_is_noisy_beyond_the_limit_and_not_at_it():
    noise = np.full((3, 4), 2.0)
    noise[0, 1] = NOISY * 2.0 + NOISY_COUNTS
    assert noisiest_taxels(noise) == []
    noise[2, 3], noise[1, 0] = noise[0, 1] + 1.0, noise[0, 1] + 9.0
    assert noisiest_taxels(noise) == [(1, 0), (2, 3)]


def test_the_fakes_rest_values_are_measured_and_the_old_file_is_kept(edge, skin, quiet):
    before = skin.read_text()
    status, (event,), _ = edge(
        "calibrate",
        "--skin",
        skin,
        "--fake",
        quiet,
        "--frames",
        50,
    )
    assert status == 0
    assert event["frames"] == 50
    assert event["kept"] == 0
    assert Path(event["backup"]).read_text() == before
    file = skinfile.load(skin)
    assert (file.calibration.baseline == 20946).all()
    assert file.calibration.taken is not None
    assert edge("check", skin)[1][0]["remarks"] == []


@pytest.mark.parametrize(
    ("options", "deviation"),
    # Rounding to whole counts adds a variance of 1/12.
    [((), (NOISE_COUNTS**2 + 1 / 12) ** 0.5), (("--noise", 3), (9 + 1 / 12) ** 0.5)],
)
def test_a_fake_makes_noise_so_that_its_dead_bands_are_rehearsed(
    edge,
    skin,
    quiet,
    options,
    deviation,
):
    fake = ("--skin", skin, "--fake", quiet, *options)
    (first,), (repetition,) = (
        edge("calibrate", *fake, "--frames", 180)[1] for _ in range(2)
    )
    assert first == repetition
    file = skinfile.load(skin)
    assert (file.calibration.noise**2).mean() ** 0.5 == pytest.approx(
        deviation, rel=0.03
    )
    assert dead_band(file.signal, file.calibration.noise).min() >= 4 * deviation
    assert (
        edge("calibrate", *fake, "--frames", 180, "--noise", 0)[1][0]["noise_largest"]
        == 0.0
    )


def test_a_skin_that_is_touched_is_refused(edge, skin, make_touch, tmp_path):
    touched = tmp_path / "touched.npz"
    saving.save(touched, make_touch(arm=False))
    before = skin.read_text()
    status, _, err = edge(
        "calibrate",
        "--skin",
        skin,
        "--fake",
        touched,
        "--frames",
        100,
    )
    assert status == 2
    assert "taxels that vary while they should be at rest: " in err
    assert skin.read_text() == before
    assert (
        edge(
            "calibrate",
            "--skin",
            skin,
            "--fake",
            touched,
            "--frames",
            100,
            "--force",
        )[0]
        == 0
    )


UNUSABLE = pytest.mark.parametrize(
    ("value", "share", "sentence"),
    [
        (
            20946,
            0.4,
            "the first at [0, 2], which was valid in 20 of 50 frames and rests at "
            "20946",
        ),
        (0, 1.0, "was valid in 50 of 50 frames and rests at 0"),
        (65535, 1.0, "rests at 65535; check the chips"),
    ],
)
"""Values and shares of a taxel that cannot be calibrated, and the sentence on it."""


@pytest.fixture
def spoil(monkeypatch):
    """Let the measurement of a taxel give a value, valid in a share of the frames."""

    def patch(value, share):
        def measured(*arguments):
            result = measure(*arguments)
            result.calibration.baseline[0, 2] = value
            result.valid[0, 2] = share * result.frames
            return result

        monkeypatch.setattr(calibrate, "measure", measured)

    return patch


@UNUSABLE
def test_taxels_that_are_not_read_or_saturated_are_refused_without_former_values(
    edge,
    skin,
    quiet,
    spoil,
    value,
    share,
    sentence,
):
    spoil(value, share)
    arguments = ("calibrate", "--skin", skin, "--fake", quiet, "--frames", 50)
    for options in ((), ("--force",)):
        status, _, err = edge(*arguments, *options)
        assert status == 2
        assert skinfile.load(skin).calibration is None
        assert sentence in err


@UNUSABLE
def test_taxels_that_are_not_read_or_saturated_keep_their_former_values_by_force(
    edge,
    skin,
    quiet,
    spoil,
    value,
    share,
    sentence,
):
    arguments = ("calibrate", "--skin", skin, "--fake", quiet, "--frames", 50)
    assert edge(*arguments)[0] == 0
    before = skin.read_text()
    spoil(value, share)
    assert edge(*arguments)[0] == 2
    assert skin.read_text() == before
    status, (event,), err = edge(*arguments, "--force")
    assert status == 0
    assert event["kept"] == 1
    assert "their former values are kept" in err
    assert skinfile.load(skin).calibration.baseline[0, 2] == 20946


def test_only_the_values_of_a_block_may_rest_at_0():
    shares = np.ones((8, 12))
    pad = skinfile.load(skinfile.shipped("mpr121"))
    assert unusable(pad, np.zeros((8, 12), np.uint16), shares).all()
    assert unusable(pad, np.full((8, 12), 1023, np.uint16), shares).all()
    matrix = skinfile.load(skinfile.shipped("matrix"))
    shape = matrix.layout.shape
    assert not unusable(matrix, np.zeros(shape, np.uint16), np.ones(shape)).any()


def test_mean_and_deviation_are_exact_at_a_large_offset():
    draw = np.random.default_rng(0)
    values = (60000 + draw.integers(-2, 3, (5000, 4, 6))).astype(np.int64)
    values[:, 0, 0] = 65535
    sums = Sums((4, 6))
    for frame in values:
        sums.add(frame.astype(np.uint16), np.ones((4, 6), bool))
    mean, deviation = sums.mean_and_deviation()
    np.testing.assert_array_equal(mean, np.rint(values.mean(axis=0)))
    exact = (values - 60000).astype(np.float64).std(axis=0, ddof=1)
    exact[0, 0] = 0.0
    np.testing.assert_allclose(deviation, exact, rtol=1e-12, atol=1e-12)


def shifted(skin, tmp_path, counts, taxels):
    """A recording of rest in which some taxels rest higher, steadily."""
    still = recording.load(tmp_path / "rest.npz")
    frames = still.frames.copy()
    for row, col in taxels:
        frames[:, row, col] = counts
    path = tmp_path / "leant.npz"
    saving.save(path, replace(still, frames=frames))
    return path


@pytest.fixture
def calibrated(edge, skin, quiet, tmp_path):
    """A skin file that was calibrated at rest."""
    saving.save(tmp_path / "rest.npz", recording.load(quiet))
    assert edge("calibrate", "--skin", skin, "--fake", quiet, "--frames", 50)[0] == 0
    return skin


SIX = [(5, 5), (5, 6), (5, 7), (6, 5), (6, 6), (6, 7)]


def leant_on(skin, folder):
    """The command that calibrates a skin on which something leans steadily."""
    leant = shifted(skin, folder, 120, SIX)
    return ("calibrate", "--skin", skin, "--fake", leant, "--frames", 50)


def test_a_skin_that_something_leans_on_steadily_is_refused(edge, calibrated, tmp_path):
    before = calibrated.read_text()
    words = leant_on(calibrated, tmp_path)
    status, _, err = edge(*words)
    assert status == 2
    assert "6 taxels side by side rest more than the onset" in err
    assert calibrated.read_text() == before
    assert edge(*words, "--force")[0] == 0


@pytest.mark.parametrize(("counts", "taxels"), [(120, SIX[:1]), (40, SIX)])
def test_a_single_taxel_or_a_small_drift_is_calibrated(
    edge,
    calibrated,
    tmp_path,
    counts,
    taxels,
):
    drifted = shifted(calibrated, tmp_path, counts, taxels)
    words = ("calibrate", "--skin", calibrated, "--fake", drifted, "--frames", 50)
    status, _, err = edge(*words)
    assert status == 0
    named = "taxel [5, 5] rests 120 counts off the former calibration" in err
    assert named == (len(taxels) == 1)


def test_a_first_calibration_under_a_contact_is_refused(edge, skin, quiet, tmp_path):
    saving.save(tmp_path / "rest.npz", recording.load(quiet))
    before = skin.read_text()
    status, _, err = edge(*leant_on(skin, tmp_path))
    assert status == 2
    assert "6 taxels side by side rest more than the onset" in err
    assert "beyond the others" in err
    assert skin.read_text() == before


def test_a_microcontrollers_skin_may_rest_above_0_which_is_said(edge, tmp_path):
    skin = tmp_path / "matrix.toml"
    skin.write_text(skinfile.shipped("matrix").read_text())
    file = skinfile.load(skin)
    saving.save(tmp_path / "still.npz", still(file, 1.0))
    words = ("calibrate", "--skin", skin, "--fake", tmp_path / "still.npz")
    status, _, err = edge(*words, "--frames", 50)
    assert status == 0
    assert "the skin rests at about 2048 counts, not at 0" in err
    zero = np.zeros(file.layout.shape, np.uint16)
    zero[3:6, 3:6] = 300
    assert np.count_nonzero(standing_out(file, zero)) == 9


def test_electrodes_of_unequal_wires_stand_out_only_where_they_are_touched():
    pad = skinfile.load(skinfile.shipped("electrodes"))
    rest = np.array([600, 612, 575, 590, 640, 605, 566, 597, 621, 580, 615, 599])
    assert not standing_out(pad, rest.reshape(4, 3).astype(np.uint16)).any()
    rest[[4, 7]] -= 200  # a touch lowers the values of an MPR121
    touched = standing_out(pad, rest.reshape(4, 3).astype(np.uint16))
    assert np.argwhere(touched > pad.layout.onset).tolist() == [[1, 1], [2, 1]]


def test_a_calibration_that_would_make_taxels_deaf_is_refused(
    edge,
    calibrated,
    tmp_path,
):
    rest = tmp_path / "rest.npz"
    words = ("calibrate", "--skin", calibrated, "--fake", rest, "--frames", 50)
    status, _, err = edge(*words, "--noise", 9)
    assert status == 2
    assert "would be deaf" in err
    assert edge(*words, "--noise", 9, "--force")[0] == 0
    status, (event,), _ = edge("check", calibrated)
    assert status == 1
    assert any("taxels deaf, such as" in remark for remark in event["remarks"])
