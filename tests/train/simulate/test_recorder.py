"""Functions run by tape give the bits that they give as they are, or run as they are."""

from copy import copy
from dataclasses import replace

import numpy as np
import pytest

from tests.train.simulate.test_simulate_called_for import everything, scene
from train.simulate import recorder as recorders
from train.simulate.assemble import make_plan
from train.simulate.engine import begin, run_batch, values_of
from train.simulate.recorder import Recorder
from train.simulate.run import kinds


def objects(*without):
    return [{k: v for k, v in one.items() if k not in without} for one in everything()]


def both_ways(one, trials, plan, step_s=0.005):
    return (
        run_batch(one, tuple(trials), step_s, plan=replace(plan, taped=taped))
        for taped in (True, False)
    )


@pytest.mark.parametrize("count", [1, 3])
@pytest.mark.parametrize(
    ("add", "without"),
    [
        (["tilt", "inertia"], ["stribeck_m_s"]),
        (["tilt"], ["stribeck_m_s", "height_m", "base_m", "skin_friction"]),
        (["inertia"], ["stribeck_m_s"]),
    ],
    ids=["all", "tilt", "inertia"],
)
def test_a_tape_gives_the_functions_bits(monkeypatch, add, without, count):
    given_up = set()
    run = Recorder.run

    def watched(recorder, *what, **how):
        run(recorder, *what, **how)
        given_up.update(recorder.given_up)

    monkeypatch.setattr(Recorder, "run", watched)
    one = scene(*add, objects=objects(*without), lead_s=0.1)
    for kind, trials in kinds(one).items():
        plan = make_plan(one, kind.effects)
        few = [trial for trial in trials if trial.number < count]
        taped, plain = both_ways(one, few, plan)
        assert plain.force.max() > 0.5
        assert taped.counts.tobytes() == plain.counts.tobytes(), kind.effects
        assert taped.joints.tobytes() == plain.joints.tobytes(), kind.effects
        for name, trace in plain.traces.items():
            assert taped.traces[name].tobytes() == trace.tobytes(), (kind.effects, name)
        assert not {plan.frame, plan.step} & given_up


def test_a_tapes_exponential_differs_in_its_last_digit_at_most():
    one = scene("tilt", "inertia", objects=objects("height_m", "base_m"), lead_s=0.1)
    kind, trials = next((k, t) for k, t in kinds(one).items() if "stribeck" in k.effects)
    taped, plain = both_ways(one, trials, make_plan(one, kind.effects))
    np.testing.assert_allclose(taped.joints, plain.joints, rtol=1e-12)


@pytest.fixture
def state():
    one = scene()
    trials = tuple(next(iter(kinds(one).values())))
    plan = make_plan(one, ())
    state = begin(one, plan, trials, 0.01, values_of(one, trials))
    for function in (*plan.frame, *plan.step, *plan.sample):
        function(state)
    return state


def test_a_branch_that_goes_another_way_has_a_tape_of_its_own(state):
    state.force = np.array([3.0, 1.0, 0.0])

    def halve(state):
        if (state.force > 1.0).any():
            state.force = state.force * 0.5
        else:
            state.force = state.force + 10.0

    recorder = Recorder(state)
    recorder.run((halve,), 3)
    np.testing.assert_array_equal(state.force, [10.75, 10.25, 10.0])
    assert len(recorder.tapes[(halve,)]) == 2


def test_an_array_that_is_another_ones_keeps_what_it_was(state):
    state.force = np.array([1.0, 2.0, 3.0])

    def before(state):
        state.approach = state.force

    def add(state):
        state.force = state.force + state.approach

    recorder = Recorder(state)
    for _ in range(2):
        before(state)
        recorder.run((add,), 2)
    np.testing.assert_array_equal(state.force, [9.0, 18.0, 27.0])


def pick(state):
    state.force = state.force[np.array([2, 1, 0])] * 2.0


def loop(state):
    state.force = state.force * float(state.force[0])


def beside(state):
    state.force = state.force + np.asarray(state.force) ** 2


def in_place(state):
    state.force += 1.0


def count(state):
    state.frames = getattr(state, "frames", 0) + 1
    state.force = state.force + 1.0


@pytest.mark.parametrize("function", [pick, loop, beside, in_place, count])
def test_what_a_tape_cannot_hold_runs_as_it_is(state, function):
    state.force = np.array([1.0, 2.0, 3.0])
    twin = copy(state)
    twin.force = state.force.copy()
    Recorder(state).run((function,), 3)
    for _ in range(3):
        function(twin)
    np.testing.assert_array_equal(state.force, twin.force)
    assert getattr(state, "frames", None) == getattr(twin, "frames", None)


def test_an_array_that_changes_its_shape_is_left_to_the_functions_that_read_it(state):
    state.image = np.ones((1, 2, 3))

    def twice(state):
        state.image = state.image * 2.0

    def add(state):
        state.force = state.force + 1.0

    recorder = Recorder(state)
    state.force = np.zeros(3)
    recorder.run((twice, add), 1)
    state.image = np.ones((1, 4, 3))
    recorder.run((twice, add), 1)
    recorder.run((twice, add), 1)
    np.testing.assert_array_equal(state.image, np.full((1, 4, 3), 4.0))
    np.testing.assert_array_equal(state.force, [3.0, 3.0, 3.0])


def test_an_array_may_grow_where_no_tape_reads_it(state):
    state.image = np.ones((1, 0, 3))

    def draw(state):
        state.image = state.force + np.zeros_like(state.force, shape=(1, 2, 3))

    state.force = np.array([1.0, 2.0, 3.0])
    recorder = Recorder(state)
    for _ in range(2):
        recorder.run((draw,), 1)
        np.testing.assert_array_equal(state.image, [[[1.0, 2.0, 3.0]] * 2])
        state.image = np.ones((1, 5, 3))


def test_no_more_tapes_than_are_of_use_are_kept(state, monkeypatch):
    monkeypatch.setattr(recorders, "TAPES", 1)
    state.force = np.array([3.0, 1.0, 0.0])

    def turn(state):
        if (state.force > 1.0).any():
            state.force = -state.force
        else:
            state.force = state.force * -1.0

    recorder = Recorder(state)
    recorder.run((turn,), 4)
    np.testing.assert_array_equal(state.force, [3.0, 1.0, 0.0])
    assert len(recorder.tapes[(turn,)]) == 1
