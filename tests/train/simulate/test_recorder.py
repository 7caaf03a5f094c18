"""Frames run by tape give the bits that their functions give as they are."""

from dataclasses import replace

import numpy as np
import pytest

from tests.train.simulate.test_simulate_called_for import everything, scene
from train.simulate.assemble import make_plan
from train.simulate.engine import begin, run_batch, values_of
from train.simulate.recorder import Recorder
from train.simulate.run import kinds
from train.simulate.tape import NotTaped


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
        ([], ["stribeck_m_s", "height_m", "base_m", "skin_friction"]),
    ],
    ids=["all", "tilt", "inertia", "neither"],
)
def test_a_tape_gives_the_functions_bits(add, without, count):
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


def run(state, *functions, times=1, frames=1):
    """Frames of one stage, and what is kept of the force in each."""
    kept = np.zeros((frames, state.n))
    recorder = Recorder(state, [(kept, lambda state: state.force)])
    recorder.run(((functions, times),), 0, frames)
    return kept


def test_what_is_kept_is_each_frames_own(state):
    state.force = np.array([3.0, 1.0, 0.0])

    def add(state):
        state.force = state.force + 1.0

    kept = run(state, add, times=2, frames=3)
    # A frame's last step is what is kept of it.
    np.testing.assert_array_equal(kept, [[5.0, 3.0, 2.0], [7.0, 5.0, 4.0], [9.0, 7.0, 6.0]])
    np.testing.assert_array_equal(state.force, kept[-1])


def test_a_branch_that_goes_another_way_has_a_tape_of_its_own(state):
    state.force = np.array([3.0, 1.0, 0.0])
    recorded = []

    def halve(state):
        recorded.append(0)
        if (state.force > 1.0).any():
            state.force = state.force * 0.5
        else:
            state.force = state.force + 1.0

    run(state, halve, times=7)
    # 3, 1.5, 0.75, 1.75, 0.875, 1.875, 0.9375, 1.9375
    np.testing.assert_array_equal(state.force, [1.9375, 1.8125, 1.75])
    assert len(recorded) == 2


def test_an_array_that_is_another_ones_keeps_what_it_was(state):
    state.force = np.array([1.0, 2.0, 3.0])
    state.approach = state.force

    def swap(state):
        state.force, state.approach = state.approach + 1.0, state.force

    run(state, swap, times=2)
    np.testing.assert_array_equal(state.force, [2.0, 3.0, 4.0])
    np.testing.assert_array_equal(state.approach, [2.0, 3.0, 4.0])


def pick(state):
    state.force = state.force[np.array([2, 1, 0])] * 2.0


def loop(state):
    state.force = state.force * float(state.force[0])


def beside(state):
    state.force = state.force + np.asarray(state.force) ** 2


def in_place(state):
    state.force += 1.0


def sum_in_place(state):
    np.add.at(state.force, np.zeros_like(state.force), state.force)


def count(state):
    state.n = state.n + 1


def widen(state):
    state.approach = state.force + np.zeros_like(state.force, shape=(2, 3))


def ask(state):
    state.columns = state.columns + 1.0


@pytest.mark.parametrize(
    "function", [pick, loop, beside, in_place, sum_in_place, count, widen, ask]
)
def test_what_a_tape_cannot_hold_is_refused_and_changes_nothing(state, function):
    state.force = np.array([1.0, 2.0, 3.0])
    before = state.columns
    with pytest.raises((NotTaped, IndexError)):
        run(state, function)
    np.testing.assert_array_equal(state.force, [1.0, 2.0, 3.0])
    assert state.n == 3
    assert state.columns is before
