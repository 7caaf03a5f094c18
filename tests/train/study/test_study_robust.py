"""The scene with one thing changed, and the same trials under it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from edge.errors import InputError
from edge.track import TrackSettings
from train.simulate import scene as scenes
from train.simulate.run import simulate
from train.study.robust import measured, variants

SCENE = Path(__file__).parents[3] / "train" / "scenes" / "cody18.toml"


@pytest.fixture(scope="module")
def scene():
    whole = scenes.load(SCENE, count=2)
    return replace(whole, objects=tuple(o for o in whole.objects if o.family == "rigid")[:2])


def test_every_effect_of_the_sensor_is_added_or_left_out(scene):
    found = variants(scene)
    assert {"speed x 0.5", "speed x 2", "arm stiffness x 0.5", "arm stiffness x 2"} < set(found)
    effects = {name.split(" ")[1] for name in found if name.startswith("with")}
    assert {"crosstalk", "hysteresis", "drift", "noise", "saturation", "dead_band"} < effects
    assert {"quantisation", "dead_taxels", "jitter", "dropped_frames"} < effects
    assert "noise" not in found["without noise"].add
    assert "drift" in found["with drift"].add
    fast = found["speed x 2"]
    assert np.array(fast.rate) * fast.travel_s == pytest.approx(
        np.array(scene.rate) * scene.travel_s
    )


def test_the_same_trials_are_measured_in_the_order_asked_for(scene):
    names = sorted(name for name, _ in simulate(scene))[::-3]
    chain = scene.arm
    X, y, lost = measured(scene, names, scene.skin, TrackSettings(), chain)
    again, _, _ = measured(scene, names[::-1], scene.skin, TrackSettings(), chain)
    assert X.shape == (len(names), 120)
    assert lost == 0
    assert (again[::-1] == X).all()
    assert y["object"][0].replace(" ", "-") in names[0]
    with pytest.raises(InputError, match="nothing.npz: the scene cody18 has no such trial"):
        measured(scene, ["nothing.npz"], scene.skin, TrackSettings(), chain)
