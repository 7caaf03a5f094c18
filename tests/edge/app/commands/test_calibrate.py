"""`edge-classify calibrate`: exact means and deviations, and a skin that must be at
rest."""

from pathlib import Path

import pytest

from edge.app.commands import calibrate
from edge.record import recording, saving
from edge.wire.fake import player
from edge.wire.fake.player import NOISE_COUNTS
from edge.wire.skin import file as skinfile
from edge.wire.skin.calibration import (
    measure,
)
from edge.wire.skin.decoder import dead_band
from tests.edge.test_writing import left_by_a_dead_run


@pytest.fixture
def measured(edge, skin):
    """Calibrate the skin from a recording; returns status, event and stderr."""

    def run(recording, *options, frames=30):
        fake = ("--skin", skin, "--fake", recording, "--frames", frames, "--yes")
        status, events, err = edge("calibrate", *fake, *options)
        return status, events[0] if events else None, err

    return run


def test_the_fakes_rest_values_are_measured_and_the_old_file_is_kept(
    edge,
    skin,
    quiet,
    measured,
):
    leftover = left_by_a_dead_run(skin.parent)
    before = skin.read_text()
    status, event, _ = measured(quiet)
    assert status == 0
    assert not leftover.exists()
    assert event["frames"] == 30
    assert event["kept"] == 0
    assert Path(event["backup"]).read_text() == before
    file = skinfile.load(skin)
    assert (file.calibration.baseline == 20946).all()
    assert "\ntaken = 20" in skin.read_text()
    assert edge("check", skin)[1][0]["remarks"] == []


def test_a_fake_makes_noise_so_that_its_dead_bands_are_rehearsed(skin, quiet, measured):
    first, repetition = (measured(quiet, frames=90)[1] for _ in range(2))
    assert first == repetition
    file = skinfile.load(skin)
    deviation = (NOISE_COUNTS**2 + 1 / 12) ** 0.5  # of rounding to whole counts too
    assert (file.calibration.noise**2).mean() ** 0.5 == pytest.approx(
        deviation, rel=0.03
    )
    assert dead_band(file.signal, file.calibration.noise).min() >= 4 * deviation


def test_a_skin_that_is_touched_is_refused(skin, make_touch, tmp_path, measured):
    touched = tmp_path / "touched.npz"
    saving.save(touched, make_touch(arm=False))
    before = skin.read_text()
    status, _, err = measured(touched)
    assert status == 2
    assert "taxels that vary while they should be at rest: 9, by up to " in err
    assert skin.read_text() == before
    assert measured(touched, "--force")[0] == 0


@pytest.mark.parametrize(("value", "share"), [(20946, 0.4), (0, 1.0), (65535, 1.0)])
def test_taxels_that_are_not_read_or_saturated_keep_their_former_values_by_force(
    skin, quiet, measured, monkeypatch, value, share
):
    def spoiled(*arguments):
        result = measure(*arguments)
        result.calibration.baseline[0, 2] = value
        result.valid[0, 2] = share * result.frames
        return result

    with monkeypatch.context() as patch:
        patch.setattr(calibrate, "measure", spoiled)
        assert measured(quiet, "--force")[0] == 2  # there are none yet
        assert skinfile.load(skin).calibration is None
    assert measured(quiet)[0] == 0
    before = skin.read_text()
    monkeypatch.setattr(calibrate, "measure", spoiled)
    status, _, err = measured(quiet)
    assert status == 2
    assert "[0, 2]" in err
    assert skin.read_text() == before
    assert measured(quiet, "--force")[1]["kept"] == 1
    assert skinfile.load(skin).calibration.baseline[0, 2] == 20946


@pytest.mark.parametrize(
    ("line", "dead"),
    [("[skin]", "[0, 1, 2, 24, 25]"), ("[signal]", "[[0, 0], [0, 1], [0, 2], [1, 0]]")],
)
def test_dead_taxels_are_neither_read_nor_in_the_way(edge, skin, quiet, line, dead):
    """Also after a calibration in which they worked, and rested elsewhere."""
    words = ("calibrate", "--skin", skin, "--fake", quiet, "--frames", 20, "--yes")
    assert edge(*words)[0] == 0
    text = skin.read_text().replace("dead = []", "")
    skin.write_text(text.replace(f"{line}\n", f"{line}\ndead = {dead}\n"))
    for _ in range(2):
        assert edge(*words)[1][0]["moving"] == []
        assert skinfile.load(skin).calibration.baseline[0, :4].tolist() == [
            0,
            0,
            0,
            20946,
        ]


def test_a_skin_on_which_all_is_dead_is_refused(edge, skin):
    text = skin.read_text().replace("dead = []", "")
    every = list(range(384))
    skin.write_text(text.replace("[skin]\n", f"[skin]\ndead = {every}\n"))
    assert edge("check", skin)[0] == 2


SIX = [(5, 5), (5, 6), (5, 7), (6, 5), (6, 6), (6, 7)]


@pytest.fixture
def leant(quiet, tmp_path):
    """Record a skin of which some taxels rest higher, steadily."""

    def save(counts, taxels):
        still = recording.load(quiet)
        for row, col in taxels:
            still.frames[:, row, col] = counts
        saving.save(tmp_path / "leant.npz", still)
        return tmp_path / "leant.npz"

    return save


@pytest.fixture
def calibrated(skin, quiet, measured):
    """A skin file that was calibrated at rest."""
    assert measured(quiet)[0] == 0
    return skin


@pytest.mark.parametrize(
    ("former", "compared"),
    [("calibrated", "off the former calibration"), ("skin", "beyond the others")],
)
def test_a_skin_that_something_leans_on_steadily_is_refused(
    request,
    measured,
    leant,
    former,
    compared,
):
    skin = request.getfixturevalue(former)
    before = skin.read_text()
    path = leant(120, SIX)
    status, _, err = measured(path)
    assert status == 2
    assert f"6 taxels side by side rest {compared}" in err
    assert skin.read_text() == before
    status, _, err = measured(path, "--force")
    assert status == 0
    assert f"rest {compared}, [5, 5], [5, 6], [5, 7], [6, 5]" in err


def test_a_first_calibration_asks_whether_the_whole_skin_is_pressed(
    edge, skin, measured, leant
):
    before = skin.read_text()
    pressed = leant(5000, [(slice(None), slice(None))])
    status, _, err = edge(
        "calibrate", "--skin", skin, "--fake", pressed, "--frames", 20
    )
    assert status == 2
    assert "the chips at 25946 to 25946, an AD7147 usually at 16384 to 49152" in err
    assert skin.read_text() == before
    assert measured(pressed)[0] == 0


@pytest.mark.parametrize(("counts", "taxels"), [(120, SIX[:1]), (40, SIX)])
def test_a_single_taxel_or_a_small_drift_is_calibrated(
    calibrated,
    measured,
    leant,
    counts,
    taxels,
):
    status, _, err = measured(leant(counts, taxels))
    assert status == 0
    is_named = "1 taxel far off the former calibration at rest: [5, 5]; if" in err
    assert is_named == (len(taxels) == 1)


def test_a_calibration_that_would_make_taxels_deaf_is_refused(
    edge,
    calibrated,
    quiet,
    measured,
    monkeypatch,
):
    monkeypatch.setattr(player, "NOISE_COUNTS", 9.0)
    status, _, err = measured(quiet)
    assert status == 2
    assert "would be deaf" in err
    assert measured(quiet, "--force")[0] == 0
    status, (event,), _ = edge("check", calibrated)
    assert status == 1
    assert any("taxels deaf, such as" in remark for remark in event["remarks"])
