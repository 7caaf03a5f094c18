"""An effect that is not called for costs nothing and changes nothing."""

import json
from itertools import product

import pytest

from edge.errors import InputError
from tests.conftest import python
from tests.train.simulate import scenes
from tests.train.simulate.scenes import run_batch
from train.simulate.engine import values_of
from train.simulate.plan import (
    INSTEAD,
    STAGES,
    kinds,
    make_plan,
    module_of,
    required_effects,
)
from train.simulate.scene import from_dict
from train.simulate.schema import EFFECTS, SENSOR_EFFECTS

MOVES = {"mass_kg": 1.0, "friction_static": 0.5, "friction_kinetic": 0.4}


def scene(*add, objects=None, axes=1, **trials):
    return scenes.scene(
        objects or scenes.one_object(conditions=["fixed", "movable"], **MOVES),
        seed=3,
        trials={"count": 3, "after_s": 0.6, **trials},
        spread={"place_m": 0.01, "roll_deg": 5.0, "friction": 0.1},
        effects={"add": list(add)},
        skin={"axes": axes},
    )


def everything():
    """One object of each family, with every key that calls for an effect; a plant of
    few stems, and one whose stems stand upright."""
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
    objects = [
        {"name": family, "family": family, "conditions": ["fixed", "movable"], **full}
        for family in ("rigid", "foam", "pillow", "bubbles", "foliage")
    ]
    few = {**objects[-1], "name": "plant", "stem_count": 6}
    return [*objects, few, {**few, "name": "grass", "stem_height_m": 0.3}]


def test_an_effect_not_called_for_is_not_loaded():
    program = (
        "import json, sys\nfrom train.simulate.scene import from_dict\nfrom "
        "train.simulate.run import simulate\ntable = {'trials': {'count': 1, "
        "'after_s': 0.2}, 'step_s': {'base': 0.01},'object': [{'name': 'box', "
        "'family': 'rigid', 'conditions': ['fixed']}]}\nassert "
        "len(list(simulate(from_dict(table)))) == 1\nprint(json.dumps([m for m in "
        "sys.modules if m.startswith('train.simulate.effects.')]))\n"
    )
    assert json.loads(python("-c", program).stdout) == ["train.simulate.effects.base"]


def test_adding_an_effect_leaves_the_others_draws():
    trial_scene = scene("noise")
    other_scene = scene("noise", "dead_taxels", "drift", "dropped_frames", "tilt")
    trials = tuple(next(iter(kinds(trial_scene).values())))
    a = values_of(trial_scene, trials)
    b = values_of(other_scene, trials)
    assert a.keys() == b.keys()
    assert all(a[key].tobytes() == b[key].tobytes() for key in a)


@pytest.fixture(scope="module")
def plan():
    """The plan of one trial of each kind, which call for every effect."""
    layers = ("foundation", "lateral", "bottoming", "relaxation")
    implied = (*layers, "pop", "stems", "shear")
    added = [name for name in EFFECTS if name not in implied]
    trial_scene = scene(*added, objects=everything(), axes=3)
    specs = tuple(specs[0] for specs in kinds(trial_scene).values())
    return make_plan(trial_scene, specs)


def owners_of(effects, stage):
    """The modules whose hooks a trial of these effects runs in a stage, in order."""
    shared = ("viscous",) if {"relaxation", "inertia"} & set(effects) else ()
    names = ("base", *shared, *effects)
    have = [n for n in names if hasattr(module_of(n), stage)]
    return have[-1:] if stage in INSTEAD else have


def test_each_trial_runs_its_own_hooks_and_no_other(plan):
    for (i, effects), stage in product(enumerate(plan.effects), STAGES):
        ran = [call.owner for call in plan.stages[stage] if call.which[i]]
        assert ran == owners_of(effects, stage), (effects, stage)


def test_these_trials_call_for_every_effect(plan):
    assert set().union(*plan.effects) == set(EFFECTS)


def bits(batch, i):
    """{name: bytes} of what a trial's recording is made of."""
    names = ("times", "arrives", "valid")
    arrays = {name: getattr(batch.all_readings[i], name) for name in names}
    arrays |= {name: getattr(batch, name)[i] for name in ("counts", "joints", "force")}
    return {name: a.tobytes() for name, a in arrays.items() if a is not None}


def test_results_do_not_depend_on_the_batch():
    add = ["tilt", "inertia", *SENSOR_EFFECTS]
    trial_scene = scene(*add, objects=everything(), after_s=0.4, count=2)
    every = tuple(spec for specs in kinds(trial_scene).values() for spec in specs)
    together = run_batch(trial_scene, every)
    assert len(bits(together, 0)) == 6
    alone = [(spec,) for spec in every[::2]]
    for specs in (*alone, every[::-1], every[3:10]):
        chosen = run_batch(trial_scene, specs)
        for i, spec in enumerate(specs):
            assert bits(chosen, i) == bits(together, every.index(spec)), spec.key


def test_a_spread_around_0_calls_for_its_effect_in_movable_objects():
    wall = scenes.one_object(name="wall")
    box = scenes.one_object(conditions=["fixed", "movable"], foot_m=0.2, **MOVES)
    spread = {"slope_deg": 1.0, "aside_m": 0.01}
    trial_scene = from_dict({"object": box + wall, "spread": spread})
    pushed, still = trial_scene.objects
    assert {"slope", "turning"} <= set(required_effects(trial_scene, pushed, "movable"))
    fixed = required_effects(trial_scene, pushed, "fixed")
    assert not {"slope", "turning"} & set(fixed)
    assert pushed.values["slope_deg"].low == 0.0
    assert "slope_deg" not in still.values
    for key, partner in (("slope_deg", "mass_kg"), ("aside_m", "foot_m")):
        sentence = f"spread.{key} .*: give a movable object {partner}"
        with pytest.raises(InputError, match=sentence):
            from_dict({"object": wall, "spread": {key: 1e-3}})
