"""What `--explain` says that effects cost adds up to the run."""

import re

import pytest

from tests.conftest import ROOT
from tests.train.simulate.scenes import make, one_object
from train.simulate.account import BASE, costs, duration
from train.simulate.convergence import kinds, measure
from train.simulate.plan import given_steps
from train.simulate.scene import load
from train.simulate.schema import SHARED

SCENES = ROOT / "train" / "scenes"


@pytest.fixture(scope="module")
def scene():
    """A scene of two kinds, one of which shares work among its effects."""
    box = one_object(name="box")
    return make(one_object(family="foam") + box, "inertia", after_s=0.2)


@pytest.fixture(scope="module")
def spent(scene):
    return costs(scene, [spec for specs in kinds(scene).values() for spec in specs])


def test_the_parts_of_all_trials_add_up_to_the_run(scene, spent):
    together = sum(
        len(specs) * sum(spent.of(effects).values())
        for effects, specs in kinds(scene).items()
    )
    assert spent.trials == 4
    assert together == pytest.approx(spent.seconds, rel=1e-9)


def test_shared_work_is_parted_among_the_effects_that_call_for_it(spent):
    assert SHARED == {"viscous": ("relaxation", "inertia")}
    alone = spent.of(("inertia",))["inertia"]
    parted = spent.of(("relaxation", "inertia"))
    assert spent.by_effect["viscous"] > 0.0
    half = 0.5 * spent.by_effect["viscous"]
    assert alone == pytest.approx(spent.by_effect["inertia"] + 2.0 * half)
    assert parted["inertia"] == pytest.approx(spent.by_effect["inertia"] + half)
    assert parted["relaxation"] == pytest.approx(spent.by_effect["relaxation"] + half)
    assert parted[BASE] == spent.by_effect[BASE]


def test_a_scene_says_why_its_steps_are_not_measured(tmp_path):
    path = tmp_path / "one.toml"
    path.write_text('[[object]]\nname = "a"\nfamily = "foam"\nconditions = ["fixed"]\n')
    assert given_steps(load(path)) == ""
    path.write_text("[step_s]\nbase = 0.005\n" + path.read_text())
    assert given_steps(load(path)).endswith("base 5 ms; the scene gives no reason")


def test_the_error_that_the_demo_states_is_that_which_is_measured():
    scene = load(SCENES / "demo.toml")
    groups = kinds(scene)
    worst = 0.0
    for kind, convergence in measure(scene, groups).items():
        place = convergence.steps_s.index(groups[kind][0].step_s)
        worst = max(worst, convergence.errors[place])
    assert worst <= 0.012
    assert "at most 1.2 %" in scene.step_reason


def test_a_run_of_very_many_steps_says_how_long_it_will_take(tmp_path):
    path = tmp_path / "one.toml"
    path.write_text(
        "[trials]\nafter_s = 60.0\n[step_s]\nbase = 1e-6\n"
        '[[object]]\nname = "a"\nfamily = "foam"\nconditions = ["fixed"]\n'
    )
    assert re.fullmatch(
        r"60,200,000 steps a trial: this will take about \S+ hours of one core",
        duration(load(path)),
    )
    assert duration(load(SCENES / "cody18.toml")) == ""
