"""What a taped array does is written down; what a tape cannot hold is said."""

import numpy as np
import pytest

from train.simulate.replay import replay
from train.simulate.tape import NotTaped, Tape, address


@pytest.fixture
def values():
    return np.random.default_rng(0).normal(size=(5, 4, 3))


def taped(values):
    tape = Tape({id(values): values})
    return tape, tape.view(values)


def work(x):
    """numpy as the simulator's functions use it."""
    wide = np.zeros_like(x, shape=(5, 6, 3))
    wide[:, 1:-1] = np.where(x > 0.0, x, -0.5 * x)
    wide[:, :-2] += np.clip(x, -0.1, 0.2)
    shared = np.broadcast_to(x[:, 0], (5, 3)) / np.maximum(x[:, 1], 0.1)
    far = np.abs(np.stack([x[0], x[1]], axis=1)).max(axis=0)
    return wide, shared, far, np.add.accumulate(np.copy(shared), axis=0)


def test_work_on_a_taped_array_is_replayed(values):
    tape, x = taped(values)
    outs = work(x)
    assert len(tape.rows) > 10
    for scale in (1.0, -2.0):
        values *= scale
        assert replay(tape.code())
        for out, want in zip(outs, work(values), strict=True):
            np.testing.assert_array_equal(np.asarray(out), want)


def test_only_any_can_be_asked_of_a_taped_array():
    values = np.ones(3)
    taped = Tape({id(values): values}).view(values)
    assert (taped > 0.5).any()
    assert not (taped > 1.5).any()
    for ask in (bool, float, int, lambda x: x[0], np.median, lambda x: x.max()):
        with pytest.raises(NotTaped):
            ask(taped if ask is not float else taped[:1])


def test_what_is_added_in_place_is_put_once(values):
    tape, x = taped(values)
    wide = np.copy(x)
    rows = len(tape.rows)
    wide[1:] += x[:-1]
    assert len(tape.rows) == rows + 1


def test_an_address_is_that_of_the_first_number(values):
    _, x = taped(values)
    for array in (values, values[1:, ::2], x, x[2:], np.broadcast_to(values[3], values.shape)):
        assert address(array) == array.__array_interface__["data"][0]
