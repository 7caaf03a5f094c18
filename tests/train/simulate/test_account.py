"""The error that `--explain` gives a scene's steps."""

from tests.conftest import ROOT
from tests.train.simulate.scenes import make, movable, specs_of
from train.simulate.account import step_error
from train.simulate.plan import kinds
from train.simulate.scene import load

DEMO = ROOT / "train" / "scenes" / "demo.toml"


def test_the_demos_steps_err_by_as_little_as_its_file_says():
    scene = load(DEMO)
    assert max(step_error(scene, specs) for specs in kinds(scene).values()) <= 0.012
    assert "at most 1.2 %" in DEMO.read_text()


def test_halving_the_step_halves_the_error():
    scene = make(movable(1.0, 0.4, 0.35, width_m=0.05))
    errors = [step_error(scene, specs_of(scene, h)) for h in (0.005, 0.0025)]
    assert 0.0 < errors[1] < 0.7 * errors[0]
