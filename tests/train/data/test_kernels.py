"""Shifts and biases that training gives."""

import numpy as np
import pytest

from edge.features.kernels import SAMPLES, convolution_of_bias, convolved, shifted
from train.data.kernels import kernel_table

RNG = np.random.default_rng(5)
TOUCHES = [RNG.integers(0, [[1 << 10], [1 << 18], [1]], (3, SAMPLES)) for _ in range(7)]


def test_shifts_bring_every_channel_to_thirteen_bits_and_leave_one_spare():
    TOUCHES[0][:2, 0] = (1 << 10) - 1, (1 << 18) - 1
    assert kernel_table(TOUCHES, 504, alike=False).shifts == (3, -5, 0)


def test_channels_of_one_unit_share_a_shift():
    assert kernel_table(TOUCHES, 504, alike=True).shifts == (-5, -5, -5)


@pytest.mark.parametrize("biases", [504, 1008])
def test_biases_are_quantiles_of_the_results_of_training(biases):
    table = kernel_table(TOUCHES, biases, alike=False)
    results = np.concatenate(
        [convolved(shifted(t, table.shifts)) for t in TOUCHES], axis=1
    )
    of_bias = results[convolution_of_bias(biases)]
    assert all(
        bias in row for bias, row in zip(table.biases, of_bias.tolist(), strict=True)
    )
    limits = np.array(table.biases)[:, None]
    shares = np.arange(1, biases + 1) * (np.sqrt(5) + 1) / 2 % 1
    assert ((of_bias < limits).mean(axis=1) <= shares).all()
    assert (shares < (of_bias <= limits).mean(axis=1)).all()
