"""The scene with one thing changed, and the same trials under it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge.errors import InputError
from train.data.dataset import load_trials
from train.report.skins import follow, vectors
from train.simulate import scene as scenes
from train.simulate.run import simulate, write
from train.study import robust
from train.study.context import Context
from train.study.robust import simulated_again, variants

SCENE = Path(__file__).parents[3] / "train" / "scenes" / "cody18.toml"
THINGS = ("plastic bin", "bed pillow")


@pytest.fixture(scope="module")
def scene():
    cody = scenes.load(SCENE, count=2)
    things = tuple(o for o in cody.objects if o.name in THINGS)
    return replace(cody, objects=things, trials={**cody.trials, "after_s": 1.7})


@pytest.fixture(scope="module")
def context(scene, tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials")
    write(scene, folder)
    data = load_trials([folder])
    return Context(data, scene)


def test_every_effect_of_the_sensor_is_added_or_left_out(scene):
    changed = variants(scene)
    of_arm = ["speed x 0.5", "arm stiffness x 0.5", "speed x 2", "arm stiffness x 2"]
    assert list(changed)[:4] == of_arm
    effects = {name.split(" ")[1] for name in list(changed)[4:]}
    assert {"crosstalk", "hysteresis", "drift", "noise", "saturation"} <= effects
    assert {"dead_band", "quantisation", "dead_taxels"} <= effects
    assert {"jitter", "dropped_frames"} <= effects
    assert "noise" not in changed["without noise"].add
    assert "drift" in changed["with drift"].add
    fast = changed["speed x 2"]
    travelled = np.array(scene.rate) * scene.travel_s
    assert np.array(fast.rate) * fast.travel_s == pytest.approx(travelled)


def test_a_scene_gives_its_recordings_again_even_those_felt_late(context, scene):
    """A light pillow gives way: it is felt a fifth of a second after a bin is."""
    assert (vectors(simulated_again(scene, context.dataset)) == context.vectors()).all()
    onsets = [trial.onset_s for trial in context.dataset.trials]
    assert max(onsets) - min(onsets) > 0.15


@pytest.mark.parametrize("change", ["with crosstalk", "without noise"])
def test_a_change_gives_the_contacts_of_its_scene_in_the_data_sets_order(
    context,
    scene,
    change,
):
    data = context.dataset
    changed = variants(scene)[change]
    trials = dict(simulate(changed))
    sensed = [trials[trial.path.name] for trial in data.trials]
    expected = vectors(follow(sensed, data.layout, data.chain))
    assert (vectors(simulated_again(changed, data)) == expected).all()
    assert (expected != context.vectors()).any()


def test_recordings_of_another_scene_are_refused(context, scene, monkeypatch):
    monkeypatch.setattr(robust, "variants", lambda scene: {})
    fewer = replace(scene, trials={**scene.trials, "count": 1})
    for foreign_scene in (fewer, replace(scene, seed=scene.seed + 1)):
        with pytest.raises(
            InputError, match="cody18 gives other trials than these recordings"
        ):
            robust.section(replace(context, scene=foreign_scene))


def test_a_trial_stays_the_draw_that_was_recorded_under_an_arm_too_weak_to_move_it(
    scene, tmp_path
):
    """What a heavy thing does under half the force is no contradiction of its label."""
    objects = scenes.load(SCENE).objects
    heavy = [thing for thing in objects if thing.name == "wooden crate"]
    single = {**scene.trials, "count": 1}
    alone = replace(scene, objects=tuple(heavy), trials=single)
    weak = variants(alone)["arm stiffness x 0.5"]
    with pytest.raises(InputError, match="contradicted"):
        list(simulate(weak))
    folder = tmp_path / "crates"
    write(alone, folder)
    assert None not in simulated_again(weak, load_trials([folder]))


@pytest.mark.parametrize(
    ("simulation", "sentence"),
    [
        (
            {"redrawn": "often"},
            "redrawn must be a whole number from 0 to 39, not 'often'",
        ),
        ({"redrawn": -1}, "redrawn must be a whole number from 0 to 39, not -1"),
        ([], r"must be a table, not \[\]"),
    ],
)
def test_a_damaged_count_of_draws_is_one_sentence(context, scene, simulation, sentence):
    first, *later_trials = context.dataset.trials
    meta = {**first.recording.meta, "simulation": simulation}
    damaged = replace(first, recording=replace(first.recording, meta=meta))
    data = replace(context.dataset, trials=(damaged, *later_trials))
    message = rf"{first.path.name}: meta\.simulation.*{sentence}"
    with pytest.raises(InputError, match=message):
        simulated_again(scene, data)
