"""An effect that is not called for costs nothing and changes nothing: six proofs."""

from __future__ import annotations

import json
import subprocess
import sys
import types
from pathlib import Path

import numpy as np
import pytest

from edge.errors import InputError
from train.simulate import streams
from train.simulate.assemble import make_plan
from train.simulate.engine import begin, kind_of, run_batch, values_of
from train.simulate.motion import MOVER
from train.simulate.plan import PYTHON_STAGES, RUN_STAGES, STAGES
from train.simulate.required_effects import required_effects
from train.simulate.run import kinds
from train.simulate.scene import from_dict
from train.simulate.schema import EFFECTS
from train.simulate.trial import SLOTS

ROOT = Path(__file__).parents[3]
MOVES = {"mass_kg": 1.0, "friction_static": 0.5, "friction_kinetic": 0.4}


def scene(*add, leave_out=(), objects=None, seed=3, **trials):
    things = objects or [
        {"name": "box", "family": "rigid", "conditions": ["fixed", "movable"], **MOVES}
    ]
    return from_dict(
        {
            "seed": seed,
            "trials": {"count": 3, "after_s": 0.6, **trials},
            "step_s": {"base": 0.01},
            "spread": {"place_m": 0.01, "roll_deg": 5.0, "friction": 0.1},
            "effects": {"add": list(add), "leave_out": list(leave_out)},
            "object": things,
        }
    )


def everything():
    """One object of each family, with every key that calls for an effect."""
    full = {
        **MOVES,
        "skin_friction": 0.3,
        "cover_n_m": 3000.0,
        "stribeck_m_s": 0.05,
        "base_m": 0.1,
        "height_m": 0.3,
        "foot_m": 0.2,
        "aside_m": 0.02,
        "slope_deg": 1.0,
    }
    return [
        {"name": family, "family": family, "conditions": ["fixed", "movable"], **full}
        for family in ("rigid", "foam", "pillow", "bubbles", "foliage")
    ]


def batch_of(one, index=0):
    kind, trials = list(kinds(one).items())[index]
    return run_batch(one, tuple(trials), 0.01), kind


def test_1_an_effect_not_called_for_is_not_loaded():
    program = (
        "import json, sys\n"
        "from train.simulate.scene import from_dict\n"
        "from train.simulate.run import simulate\n"
        "table = {'trials': {'count': 1, 'after_s': 0.2}, 'step_s': {'base': 0.01},"
        "'object': [{'name': 'box', 'family': 'rigid', 'conditions': ['fixed']}]}\n"
        "assert len(list(simulate(from_dict(table)))) == 1\n"
        "print(json.dumps([m for m in sys.modules if m.startswith('train.simulate.effects.')]))\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert json.loads(done.stdout) == []


@pytest.mark.parametrize("add", [(), ("noise", "tilt")])
def test_2_uncalled_effects_may_raise_and_no_bit_changes(monkeypatch, add):
    one = scene(*add)
    before = [batch_of(one, i)[0] for i in range(2)]
    for i, kind in enumerate(kinds(one)):
        for name in EFFECTS:
            if name not in kind.effects:
                bomb = types.ModuleType(name)
                bomb.__getattr__ = lambda attribute, name=name: pytest.fail(f"{name} was touched")
                monkeypatch.setitem(sys.modules, f"train.simulate.effects.{name}", bomb)
        after = batch_of(one, i)[0]
        monkeypatch.undo()
        assert before[i].counts.tobytes() == after.counts.tobytes()
        assert before[i].joints.tobytes() == after.joints.tobytes()


OWN = {
    "lateral": {"lateral"},
    "cover": {"cover"},
    "pop": {"pop"},
    "stems": {"stems"},
    "tilt": {"tilt"},
    "relaxation": {"viscous"},
    "inertia": {"inertia", "viscous"},
    "friction": {"friction"},
    "sliding": {"motion"},
    "turning": {"turning"},
    "stribeck": {"stribeck"},
    "tipping": {"tipping"},
}


BASE_ARRAYS = {
    *("weight", "line_gap", "line_depth", "gaps", "stiffness"),
    *("column_gaps", "reach", "law_gaps", "slopes", "intercepts", "image"),
}


def test_3_only_the_called_effects_state_exists():
    called = ("tilt", "inertia", "noise", "dead_taxels", "jitter", "dropped_frames")
    one = scene(*called, objects=everything())
    for i, kind in enumerate([*kinds(one)]):
        batch = batch_of(one, i)[0]
        expected = set().union(*(OWN.get(name, set()) for name in kind.effects))
        assert {SLOTS[part.slot] for part in batch.state.own} == expected, kind.effects
        for own in batch.state.trial.own:
            assert {SLOTS[slot] for slot in np.flatnonzero(own)} == expected, kind.effects
        traces = {"sliding": "slide_m", "turning": "turn_rad"}
        called = {name for effect, name in traces.items() if effect in kind.effects}
        assert set(batch.traces) == {"depth_m", *called}
        assert ("alive" in batch.state.arrays) is ("pop" in kind.effects)
        assert batch.kept is not None
        assert batch.valid is not None
    bare = batch_of(scene(), 0)[0]
    assert (bare.state.own, set(bare.traces)) == ({}, {"depth_m"})
    assert not bare.state.trial.own.any()
    assert set(bare.state.arrays) == BASE_ARRAYS
    assert bare.times is bare.kept is bare.valid is None


def test_4_adding_an_effect_leaves_the_others_draws():
    one, two = scene("noise"), scene("noise", "dead_taxels", "drift", "dropped_frames", "tilt")
    trials = tuple(next(iter(kinds(one).values())))
    a, b = values_of(one, trials), values_of(two, trials)
    assert a.keys() == b.keys()
    for key in a:
        assert a[key].tobytes() == b[key].tobytes()
    # Before the contact nothing but the noise's own draws is to be seen.
    far = {"lead_s": 5.0, "after_s": 0.1}
    one = scene("noise", **far)
    two = scene("noise", "dropped_frames", "crosstalk", "tilt", "saturation", **far)
    first, second = (batch_of(s)[0].counts[:, :499] for s in (one, two))
    assert first.any()
    np.testing.assert_array_equal(first, second)


def test_4_streams_go_by_name_not_by_place():
    draw = streams.stream(3, "noise", "box-fixed", 0).random(4)
    streams.stream(3, "drift", "box-fixed", 0).random(9)
    np.testing.assert_array_equal(draw, streams.stream(3, "noise", "box-fixed", 0).random(4))
    for other in (
        streams.stream(4, "noise", "box-fixed", 0),
        streams.stream(3, "drift", "box-fixed", 0),
        streams.stream(3, "noise", "box-movable", 0),
        streams.stream(3, "noise", "box-fixed", 1),
        streams.stream(3, "noise", "box-fixed"),
    ):
        assert (other.random(4) != draw).all()
    # The same on every machine and in every version: the first words of the name's hash.
    assert streams.key("noise") == (3232097007, 3611913630)


def test_5_the_number_of_functions_is_exact():
    bare = make_plan(scene(), ())
    assert {s: len(getattr(bare, s)) for s in STAGES} == {
        "setup": 6,
        "pace": 0,
        "tune": 1,
        "frame": 1,
        "step": 3,
        "sample": 3,
        "clock": 0,
        "sensor": 0,
    }
    implied = ("foundation", "lateral", "bottoming", "relaxation", "pop", "stems")
    one = scene(*[n for n in EFFECTS if n not in implied], objects=everything())
    seen = set()
    for kind in kinds(one):
        plan = make_plan(one, kind.effects)
        extra = sum(EFFECTS[name].functions for name in kind.effects)
        if {"relaxation", "inertia"} & set(kind.effects):
            extra += 4 if "tilt" in kind.effects else 3  # what the two share
        if {"friction", "sliding"} <= set(kind.effects):
            extra += 1  # the shear loads the floor
        if {"friction", "tilt"} <= set(kind.effects):
            extra += 1  # and an askew skin
        assert len(plan) == len(bare) + extra, kind.effects
        seen |= set(kind.effects)
    assert seen == set(EFFECTS)


@pytest.mark.parametrize("sensor", [False, True])
def test_6_results_do_not_depend_on_the_batch(sensor):
    add = ["tilt", "inertia"]
    if sensor:
        add += [n for n, info in EFFECTS.items() if info.stage in ("sensor", "clock")]
    one = scene(*add, objects=everything(), after_s=0.4, count=3)
    for kind, trials in kinds(one).items():
        trials = tuple(trials)
        whole = run_batch(one, trials, 0.01)
        for part in (trials[:1], trials[::-1]):
            some = run_batch(one, part, 0.01)
            where = [trials.index(t) for t in part]
            assert some.counts.tobytes() == whole.counts[where].tobytes(), kind.effects
            assert some.joints.tobytes() == whole.joints[where].tobytes(), kind.effects
            assert some.force.tobytes() == whole.force[where].tobytes(), kind.effects
            if sensor:
                for name in ("times", "kept", "valid"):
                    read, all_read = getattr(some, name), getattr(whole, name)
                    assert read.tobytes() == all_read[where].tobytes(), (name, kind.effects)


def test_who_called_is_told():
    one = scene("noise", "stribeck", objects=everything())
    foam = next(o for o in one.objects if o.family == "foam")
    called = required_effects(one, foam, "movable")
    assert called["relaxation"] == "family foam"
    assert called["sliding"] == "movable"
    assert called["cover"] == "cover_n_m"
    assert called["tipping"] == "base_m and height_m"
    assert called["noise"] == "effects.add"
    assert "sliding" not in required_effects(one, foam, "fixed")
    assert "stribeck" not in required_effects(one, foam, "fixed")
    assert kind_of(one, foam, "fixed") != kind_of(one, foam, "movable")


def test_leaving_out_what_is_implied():
    one = scene(leave_out=["relaxation"], objects=everything())
    foam = next(o for o in one.objects if o.family == "foam")
    assert "relaxation" not in required_effects(one, foam, "fixed")
    assert "foundation" in required_effects(one, foam, "fixed")


def test_the_plan_is_flat():
    plan = make_plan(scene("tilt"), ("tilt", "sliding"))
    trials = tuple(list(kinds(scene("tilt")).values())[1])
    state = begin(scene("tilt"), plan, trials, 0.01, values_of(scene("tilt"), trials))
    assert all(callable(f) for stage in PYTHON_STAGES for f in getattr(plan, stage))
    found = [address for stage in RUN_STAGES for address in plan.addresses(stage)]
    assert all(found)
    assert len(set(found)) == len(found) == len(plan) - len(plan.setup)
    assert state.of(MOVER).slide.shape == (3,)
    assert set(STAGES) == {*PYTHON_STAGES, *RUN_STAGES}


def test_a_spread_around_0_calls_for_its_effect_in_what_is_movable():
    boxes = [
        {"name": "box", "family": "rigid", "conditions": ["fixed", "movable"], "foot_m": 0.2,
         "mass_kg": 1.0, "friction_static": 0.4, "friction_kinetic": 0.35},
        {"name": "wall", "family": "rigid", "conditions": ["fixed"]},
    ]  # fmt: skip
    one = from_dict({"object": boxes, "spread": {"slope_deg": 1.0, "aside_m": 0.01}})
    box, wall = one.objects
    assert {"slope", "turning"} <= set(required_effects(one, box, "movable"))
    assert not {"slope", "turning"} & set(required_effects(one, box, "fixed"))
    assert (box.values["slope_deg"].low, "slope_deg" in wall.values) == (0.0, False)
    for key, needed in (("slope_deg", "mass_kg"), ("aside_m", "foot_m")):
        with pytest.raises(InputError, match=f"spread.{key} .*: give a movable object {needed}"):
            from_dict({"object": [boxes[1]], "spread": {key: 1e-3}})


@pytest.mark.parametrize("band", [10.0, 30.0])
def test_a_dead_band_hides_all_noise_that_it_is_wider_than(band):
    seen = []
    for add in ((), ("crosstalk",)):  # which asks for all taxels, and leaks nothing
        one = scene("noise", "dead_band", *add)
        one.settings.update(
            noise={"counts": 5.0}, dead_band={"counts": band}, crosstalk={"part": 0.0}
        )
        seen.append(batch_of(one)[0].counts)
    assert seen[0].tobytes() == seen[1].tobytes()
    noisy = (seen[0][:, 0] > 0).any()
    assert noisy if band < 21.0 else not noisy
