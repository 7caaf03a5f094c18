"""`edge-classify calibrate`: exact means and deviations, and a skin that must be at rest."""

from pathlib import Path

import numpy as np

from edge import recording
from edge.commands.calibrate import RESTLESS, RESTLESS_COUNTS, mean_and_deviation, restless
from edge.skin import file as skinfile


def test_a_taxel_is_restless_beyond_the_limit_and_not_at_it():
    noise = np.full((3, 4), 2.0)
    noise[0, 1] = RESTLESS * 2.0 + RESTLESS_COUNTS
    assert restless(noise) == []
    noise[2, 3], noise[1, 0] = noise[0, 1] + 1.0, noise[0, 1] + 9.0
    assert restless(noise) == [(1, 0), (2, 3)]


def test_the_fakes_rest_values_are_measured_and_the_old_file_is_kept(edge, skin, quiet):
    before = skin.read_text()
    status, (event,), _ = edge("calibrate", "--skin", skin, "--fake", quiet, "--frames", 50)
    assert (status, event["frames"], event["unread"]) == (0, 50, 0)
    assert Path(event["backup"]).read_text() == before
    file = skinfile.load(skin)
    assert (file.calibration.baseline == 20946).all()
    assert (file.calibration.noise == 0.0).all()
    assert file.calibration.taken is not None
    assert edge("check", skin)[1][0]["remarks"] == []


def test_a_skin_that_is_touched_is_refused(edge, skin, make_touch, tmp_path):
    touched = tmp_path / "touched.npz"
    recording.save(touched, make_touch(arm=False))
    before = skin.read_text()
    status, _, err = edge("calibrate", "--skin", skin, "--fake", touched, "--frames", 100)
    assert status == 2
    assert "taxels that vary while they should be at rest: " in err
    assert skin.read_text() == before
    assert edge("calibrate", "--skin", skin, "--fake", touched, "--frames", 100, "--force")[0] == 0


def test_mean_and_deviation_are_exact_at_a_large_offset():
    draw = np.random.default_rng(0)
    values = (60000 + draw.integers(-2, 3, (5000, 4, 6))).astype(np.int64)
    values[:, 0, 0] = 65535
    mean, deviation = mean_and_deviation(
        np.full((4, 6), 5000), values.sum(axis=0), (values * values).sum(axis=0)
    )
    np.testing.assert_array_equal(mean, np.rint(values.mean(axis=0)))
    exact = (values - 60000).astype(np.float64).std(axis=0, ddof=1)
    exact[0, 0] = 0.0
    np.testing.assert_allclose(deviation, exact, rtol=1e-12, atol=1e-12)
