"""Random numbers that stay where they are when something is added beside them."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from train.simulate import streams


def test_a_stream_is_the_same_on_every_machine():
    # `printf noise | sha256sum` begins so; two words, low byte first.
    digest = bytes.fromhex("efe2a5c09e6d49d7")
    assert streams.key("noise") == tuple(np.frombuffer(digest, dtype="<u4").tolist())


@pytest.mark.parametrize("kind", ["random", "standard_normal"])
def test_a_trials_draw_does_not_depend_on_the_trials_beside_it(kind):
    every = streams.draws(3, "yaw", "soft", np.arange(1000), kind)
    numbers = np.array([7, 2, 31])
    assert_array_equal(streams.draws(3, "yaw", "soft", numbers, kind), every[numbers])
    want = getattr(streams.stream(3, "yaw", "soft"), kind)(1000)
    assert_array_equal(every, np.clip(want, -2.5, 2.5))


def test_noise_is_normal_and_each_number_takes_two_bytes():
    values = np.zeros((1000, 200), dtype=np.float32)
    streams.add_normal(np.random.default_rng(0), 3.0, values)
    assert abs(float(values.mean())) < 12 / np.sqrt(values.size)
    assert float(values.std()) == pytest.approx(3.0, abs=0.03)
    assert 12.6 < float(np.abs(values).max()) < 13.2
    generator_again = np.random.default_rng(0)
    generator_again.bytes(2 * values.size)
    fresh = np.random.default_rng(0)
    numbers = np.full_like(values, 7.0)
    streams.add_normal(fresh, 3.0, numbers)
    assert fresh.random() == generator_again.random()
    assert_array_equal(numbers, np.float32(7.0) + values)
