"""Exact means and deviations, and taxels that are unlike the others at rest."""

import numpy as np

from edge.wire.skin import file as skinfile
from edge.wire.skin.calibration import (
    NOISY,
    NOISY_COUNTS,
    Sums,
    noisiest_taxels,
    standing_out,
    unusable,
)


def test_a_taxel_is_noisy_beyond_the_limit_and_not_at_it():
    file = skinfile.load(skinfile.shipped("mpr121"))
    noise = np.full(file.layout.shape, 2.0)
    noise[0, 1] = NOISY * 2.0 + NOISY_COUNTS
    assert noisiest_taxels(file, noise) == []
    noise[2, 3], noise[1, 0] = noise[0, 1] + 1.0, noise[0, 1] + 9.0
    assert noisiest_taxels(file, noise) == [(1, 0), (2, 3)]


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


def test_taxels_side_by_side_stand_out_of_a_skin_that_rests_at_0():
    file = skinfile.load(skinfile.shipped("matrix"))
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
