"""What `--explain` says that effects cost adds up to the run."""

from tests.conftest import ROOT
from train.simulate.convergence import kinds, measure
from train.simulate.plan import given_steps
from train.simulate.scene import load

SCENES = ROOT / "train" / "scenes"


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
