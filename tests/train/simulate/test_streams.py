"""Random numbers that stay where they are when something is added beside them."""

import numpy as np
import pytest

from train.simulate import streams


def test_a_stream_is_the_same_on_every_machine():
    # `printf noise | sha256sum` begins so; two words, low byte first.
    said = bytes.fromhex("efe2a5c09e6d49d7")
    assert streams.key("noise") == tuple(np.frombuffer(said, dtype="<u4").tolist())
    first = streams.stream(1, "noise", "soft", 0).integers(0, 1 << 32, 3)
    assert first.tolist() == streams.stream(1, "noise", "soft", 0).integers(0, 1 << 32, 3).tolist()


@pytest.mark.parametrize("seed", [0, 2012, 2**32 + 7, 2**63 - 1])
def test_a_stream_is_numpys_own_of_the_seed_and_its_words(seed):
    words = (*streams.key("noise"), *streams.key("soft"), 5)
    for trial, spawn_key in ((5, words), (None, words[:-1])):
        sequence = np.random.SeedSequence(seed, spawn_key=spawn_key)
        want = np.random.Generator(np.random.PCG64(sequence)).random(4)
        np.testing.assert_array_equal(streams.stream(seed, "noise", "soft", trial).random(4), want)


@pytest.mark.parametrize(
    "other", [(2, "noise", "soft", 0), (1, "drift", "soft", 0), (1, "noise", "hard", 0),
              (1, "noise", "soft", 1), (1, "noise", "soft", None), (1, "soft", "noise", 0)]
)  # fmt: skip
def test_seed_name_condition_and_trial_each_give_another_stream(other):
    numbers = streams.stream(1, "noise", "soft", 0).random(4)
    assert not np.isin(streams.stream(*other).random(4), numbers).any()


@pytest.mark.parametrize("kind", ["random", "standard_normal"])
def test_a_trial_s_draw_does_not_hang_on_the_trials_beside_it(kind):
    every = streams.draws(3, "yaw", "soft", np.arange(50), kind)
    some = np.array([7, 2, 31])
    np.testing.assert_array_equal(streams.draws(3, "yaw", "soft", some, kind), every[some])
    if kind == "random":
        np.testing.assert_array_equal(every, streams.stream(3, "yaw", "soft").random(50))
    else:
        want = np.clip(streams.stream(3, "yaw", "soft").standard_normal(50), -2.5, 2.5)
        np.testing.assert_array_equal(every, want)
        assert np.abs(streams.draws(3, "p", "s", np.arange(10_000), kind)).max() == 2.5


def noise(*shape: int) -> np.ndarray:
    values = np.zeros(shape, dtype=np.float32)
    streams.add_normal(np.random.default_rng(0), 1.0, values)
    return values


def test_noise_is_normal_and_each_number_takes_two_bytes():
    values = noise(1000, 200)
    assert abs(float(values.mean())) < 4 / np.sqrt(values.size)
    assert float(values.std()) == pytest.approx(1.0, abs=0.01)
    assert float(np.abs(values).max()) < 4.4
    again = np.random.default_rng(0)
    again.bytes(2 * values.size)
    fresh = np.random.default_rng(0)
    numbers = np.full_like(values, 7.0)
    streams.add_normal(fresh, 1.0, numbers)
    assert fresh.random() == again.random()
    np.testing.assert_array_equal(numbers, np.float32(7.0) + values)


def test_the_quantiles_are_in_order_and_as_wide_as_asked_for():
    assert (np.diff(streams.quantiles()) >= 0.0).all()
    np.testing.assert_array_equal(streams.quantiles(3.0), streams.quantiles() * np.float32(3.0))
    assert streams.quantiles()[-1] == -streams.quantiles()[0]
