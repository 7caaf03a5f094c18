"""Each operation of a tape gives numpy's bits, on arrays of any shape that a tape can hold."""

import numpy as np
import pytest

from train.simulate.replay import CODE, replay, run_frames
from train.simulate.tape import NotTaped, Tape

ONE = ("negative", "absolute", "sqrt", "sin", "cos", "floor", "rint", "logical_not")
TWO = ("add", "subtract", "multiply", "divide", "maximum", "minimum")
ASKED = ("greater", "greater_equal", "less", "less_equal", "logical_and", "logical_or")
SHAPES = [
    ((5, 7), (5, 7)),
    ((5, 7), (7,)),
    ((3, 1, 7), (5, 7)),
    ((3, 5, 7), (3, 5, 1)),
    ((5, 1), (5, 1)),
    ((4, 1), (1, 1)),
    ((1,), (1,)),
]


def numbers(shape, seed=0):
    values = np.random.default_rng(seed).normal(size=shape)
    values.flat[:: max(1, values.size // 3)] = 0.0
    return values


def run(name, *inputs):
    """What a tape of this one operation gives."""
    lasting = {id(array): array for array in inputs if isinstance(array, np.ndarray)}
    tape = Tape(lasting)
    out = tape.put(name, inputs)
    assert replay(tape.code())
    return np.asarray(out)


@pytest.mark.parametrize("shapes", SHAPES, ids=str)
@pytest.mark.parametrize("name", [*ONE, *TWO, *ASKED])
def test_an_operation_gives_numpys_bits(name, shapes):
    inputs = [numbers(shape, seed) for seed, shape in enumerate(shapes)]
    inputs = inputs[:1] if name in ONE else inputs
    with np.errstate(all="ignore"):
        want = np.asarray(getattr(np, name)(*inputs), dtype=float)
    np.testing.assert_array_equal(run(name, *inputs), want)


def test_an_exponential_is_within_its_last_digit():
    values = numbers((5, 7))
    np.testing.assert_allclose(run("exp", values), np.exp(values), rtol=3e-16)


def test_a_number_stands_for_an_array_of_it():
    values = numbers((5, 7))
    np.testing.assert_array_equal(run("add", values, 2.5), values + 2.5)
    np.testing.assert_array_equal(run("where", values, 1.0, -0.5), np.where(values, 1.0, -0.5))


@pytest.mark.parametrize("limits", [(-0.5, 0.5), (0.0, np.inf), (-np.inf, -0.1)])
def test_numbers_are_cut_as_numpy_cuts_them(limits):
    values = numbers((5, 7))
    np.testing.assert_array_equal(run("clip", values, *limits), np.clip(values, *limits))
    values[2] = np.nan
    np.testing.assert_array_equal(run("clip", values, *limits), np.clip(values, *limits))
    np.testing.assert_array_equal(run("maximum", values, 0.0), np.maximum(values, 0.0))
    np.testing.assert_array_equal(run("minimum", values, 0.0), np.minimum(values, 0.0))


def test_rows_are_picked_by_number():
    values, order = numbers((6, 7)), np.argsort(numbers((6, 7), 1), axis=0)
    want = np.take_along_axis(values, order, 0)
    np.testing.assert_array_equal(run("gather", values, order.astype(float)), want)


@pytest.mark.parametrize("n", [1, 7])
@pytest.mark.parametrize("name", ["add", "maximum", "minimum"])
def test_what_goes_along_an_axis_goes_one_after_the_other(name, n):
    values = numbers((6, 2, n))
    for running, method in ((False, "reduce"), (True, "accumulate")):
        tape = Tape({id(values): values})
        out = tape.along(name, tape.view(values), running)
        replay(tape.code())
        want = getattr(getattr(np, name), method)(values, axis=0)
        np.testing.assert_array_equal(np.asarray(out), want)


def test_what_does_not_lie_side_by_side_is_copied_first():
    wide = numbers((5, 14))
    tape = Tape({id(wide): wide})
    out = tape.put("add", (wide[:, ::2], wide.T[:7].T))
    replay(tape.code())
    np.testing.assert_array_equal(np.asarray(out), wide[:, ::2] + wide[:, :7])


@pytest.mark.parametrize("axis", [0, 1])
def test_sums_run_along_any_axis(axis):
    values = numbers((6, 5, 7))
    tape = Tape({id(values): values})
    out = np.add.accumulate(tape.view(values), axis=axis)
    replay(tape.code())
    np.testing.assert_array_equal(np.asarray(out), np.add.accumulate(values, axis=axis))


def test_sums_by_number_are_added_one_after_the_other():
    values, places = numbers((6, 7)), np.random.default_rng(1).integers(0, 5, (6, 7))
    want = np.zeros(5)
    np.add.at(want, places, values)
    index = places.astype(float)
    tape = Tape({id(values): values, id(index): index})
    out = tape.put("copy", (0.0,), tape.new((5,)))
    np.add.at(out, tape.view(index).astype(np.int64), tape.view(values))
    replay(tape.code())
    np.testing.assert_array_equal(np.asarray(out), want)


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.uint16])
def test_a_frame_is_kept_in_its_place_and_kind(kind):
    values = np.rint(numbers((5, 4, 3)) ** 2 * 100.0)
    room = np.zeros((3, 6, 5, 4), dtype=kind).transpose(1, 2, 3, 0)
    tape = Tape({id(values): values})
    tape.keep(room, tape.view(values))
    clock = np.array([2, 0, 0])
    assert run_frames(tape.code(), np.array([[0, 0, 1]]), np.array([1]), clock, 4)
    np.testing.assert_array_equal(room[2], values.astype(kind))
    np.testing.assert_array_equal(room[3], values.astype(kind))
    assert not room[[0, 1, 4, 5]].any()


def test_frames_end_where_a_branch_would_go_another_way():
    left, none = np.array([3.0, 0.0]), np.zeros(2)
    tape = Tape({id(left): left, id(none): none})
    fewer = tape.put("subtract", (left, 1.0))
    some = tape.put("greater", (fewer, 0.0))
    tape.emit("any", some.shape, [some, some], expected=True)
    tape.emit("copy", left.shape, [left, fewer])
    # 2 is found above 0 and so is 1, but 0 is not: the third run changes nothing.
    clock = np.array([0, 0, 0])
    ways = np.array([[0, 0, len(tape.rows)]])
    assert not run_frames(tape.code(), ways, np.array([2]), clock, 5)
    np.testing.assert_array_equal(left, [1.0, -2.0])
    np.testing.assert_array_equal(clock, [1, 0, 0])
    assert not replay(tape.code())


def test_four_dimensions_that_cannot_become_three_are_refused():
    wide = numbers((4, 4, 4, 6))
    tape = Tape({id(wide): wide})
    with pytest.raises(NotTaped):
        tape.put("add", (wide[::2, ::2, ::2], 1.0))
    assert set(CODE) >= {*ONE, *TWO, *ASKED}
