"""A trial's record finds what each effect keeps of the trial."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import train.simulate
from tests.train.simulate.scenes import make, one_object
from train.simulate.assemble import make_plan
from train.simulate.compiled import addresses, each, vector
from train.simulate.engine import begin, values_of
from train.simulate.run import kinds
from train.simulate.schema import EFFECTS
from train.simulate.trial import SLOTS, Part, compiled

MODULES = sorted(Path(train.simulate.__file__).parent.rglob("*.py"))
NOTE = Part("noise", "seen", ("place", "f8", (2,)), ("given", "i8"))
"""In the slot of an effect that keeps nothing of a trial."""
note_of = NOTE.of


@compiled
def take_note(t):
    own = note_of(t)
    given = vector(own.given, 2)
    own.seen += t.z
    own.place[1] = given[0]
    given[1] = t.h


@pytest.fixture
def state():
    scene = make(one_object(), count=3)
    trials = tuple(next(iter(kinds(scene).values())))
    return begin(scene, make_plan(scene, ()), trials, 0.01, values_of(scene, trials))


def test_a_trial_finds_its_own_part_and_what_is_lent_to_it(state):
    state.trial.z = [1.0, 2.0, 3.0]
    own = state.begin(NOTE, seen=[10.0, 20.0, 30.0])
    own.given = state.lend("given", np.array([[4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]))
    assert state.of(NOTE) is own
    assert (state.trial.here == addresses(state.trial)).all()
    each(np.array([take_note.address]), state.trial.here[1:])
    assert own.seen.tolist() == [10.0, 22.0, 33.0]
    assert own.place.tolist() == [[0.0, 0.0], [0.0, 5.0], [0.0, 6.0]]
    assert state.arrays["given"].tolist() == [[4.0, 7.0], [5.0, 0.01], [6.0, 0.01]]


def test_a_place_is_the_address_of_a_field_of_the_trial_or_of_a_part(state):
    state.trial.t = [0.1, 0.2, 0.3]
    own = state.begin(NOTE, seen=[7.0, 8.0, 9.0])
    places = state.places([(None, "t"), (NOTE, "seen"), (NOTE, "place")])
    own.place[:, 0] = [4.0, 5.0, 6.0]
    found = [[vector(address, 1)[0] for address in row] for row in places]
    assert found == [[0.1, 0.2, 0.3], [7.0, 8.0, 9.0], [4.0, 5.0, 6.0]]


def test_no_two_parts_share_a_slot():
    assert set(SLOTS) == {"motion", "viscous", *EFFECTS}
    assert len(set(SLOTS)) == len(SLOTS)
    root = MODULES[0].parents[2]
    names = [".".join(path.relative_to(root).with_suffix("").parts) for path in MODULES]
    parts = {id(x): x for n in names for x in vars(import_module(n)).values() if type(x) is Part}
    slots = [SLOTS[part.slot] for part in parts.values()]
    assert len(slots) > 10
    assert len(set(slots)) == len(slots)
    with pytest.raises(ValueError, match="not in tuple"):
        Part("nothing")
