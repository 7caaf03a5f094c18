"""Trials do what their labels say, and families are drawn from their ranges."""

from dataclasses import replace

import numpy as np
import pytest

from edge.errors import InputError
from tests.train.simulate import scenes
from tests.train.simulate.scenes import run
from train.simulate import engine, truth
from train.simulate.run import simulate, write

(BOX,) = scenes.movable([0.5, 6.0], 0.6, 0.5, width_m=0.05, name="box")
CRATES = {"name": "crate", "count": 6, "conditions": ["fixed", "movable"]}
FAMILY = {**BOX, **CRATES, "friction_static": [0.3, 0.6]}
del FAMILY["friction_kinetic"]


def scene(*objects, **rest):
    trials = {"count": 1, "lead_s": 0.1, "after_s": 1.4}
    return scenes.scene(objects, **{"trials": trials, **rest})


def refused(trial_scene, match):
    """The simulation is refused by a sentence."""
    with pytest.raises(InputError, match=match):
        list(simulate(trial_scene))


@pytest.fixture(autouse=True)
def few_draws(monkeypatch):
    monkeypatch.setattr(truth, "REDRAWS", 8)


class TestLabels:
    def test_a_movable_object_slides_within_the_window(
        self,
        tmp_path,
    ):
        """Some of the boxes are too heavy to slide."""
        boxes = scene(BOX, trials={"count": 12, "after_s": 1.4})
        stuck = (run(boxes).traces["slide_m"][:, :142].max(axis=1) < 0.02).sum()
        assert stuck > 0
        redrawn = [r.meta["simulation"]["redrawn"] for _, r in simulate(boxes)]
        assert np.count_nonzero(redrawn) == stuck
        assert write(boxes, tmp_path).redrawn == {"moved too little": stuck}

    def test_a_movable_object_that_never_slides_is_refused(self):
        heavy = scene({**BOX, "mass_kg": 20.0})
        refused(heavy, r"'box' is labelled movable.* moved 0 mm.*lower")

    def test_a_soft_object_that_never_yields_is_refused(self, monkeypatch):
        runs = []

        def counted(*arguments):
            runs.append(arguments)
            return engine.run_physics(*arguments)

        monkeypatch.setattr(truth, "REDRAWS", 40)
        monkeypatch.setattr(truth, "run_physics", counted)
        stone = scenes.one_object(name="stone", family="foam", modulus_pa=1e9)
        refused(scene(*stone), "'stone' is labelled soft.*lower its stiffness")
        # Each run has more of the further draws.
        assert len(runs) == 4

    def test_a_motion_that_never_touches_is_refused(self):
        trial_scene = scene({**BOX, "conditions": ["fixed"]})
        still = replace(trial_scene, damping=(0.0,) * 5, travel_s=1e-6)
        refused(still, "was never touched.*motion")

    def test_an_object_inside_the_arm_is_refused(self):
        wide = scenes.one_object(name="wall", width_m=1.0)
        rest = {"spread": {"yaw_deg": 30.0}, "effects": {"add": ["tilt", "inertia"]}}
        trial_scene = scene(*wide, **rest)
        says = r"'wall' touches the arm before it moves, in trial \d .* by \d\d degrees; .*yaw_deg"
        refused(trial_scene, says)


class TestFamilies:
    def test_objects_are_drawn_within_their_ranges(self):
        trial_scene = scene(families=[FAMILY])
        assert [o.name for o in trial_scene.objects] == [
            f"crate {i:02d}" for i in range(1, 7)
        ]
        masses = [o.values["mass_kg"].low for o in trial_scene.objects]
        assert len(set(masses)) == 6
        for o in trial_scene.objects:
            mu = o.values["friction_static"].low
            assert 0.8 * mu <= o.values["friction_kinetic"].low <= 0.95 * mu
            assert o.conditions == ("fixed", "movable")

    @pytest.mark.parametrize(
        "keys",
        [
            {},
            {"family": "foam", "friction_static": [0.3, 1.0], "skin_friction": 0.9},
            {"family": "foliage", "stem_height_m": 0.5, "breadth_m": [0.1, 0.5]},
        ],
    )
    def test_no_object_holds_more_than_can_be_pushed(self, keys):
        """The skin's shear makes an object harder to move; stems push no more than they
        bear, and if they stand upright, those beside the forearm nothing."""
        for o in scene(families=[{**FAMILY, **keys, "count": 40}]).objects:
            value = {name: number.low for name, number in o.values.items()}
            mu = value["friction_static"]
            most = 6.0 * (1.0 - value.get("skin_friction", 0.0) * mu)
            if o.family == "foliage":
                met = value["stem_count"] * 0.0921 / value["breadth_m"]
                most = min(most, met * value["stem_n_m"] * 0.06)
            assert mu * value["mass_kg"] * 9.80665 <= most

    def test_the_draws_are_the_familys_own(self):
        trunk = {**FAMILY, "name": "trunk"}
        two_families = scene(families=[trunk, FAMILY])
        assert two_families.objects[6:] == scene(families=[FAMILY]).objects
        second_seed = scene(families=[FAMILY], seed=5)
        assert second_seed.objects[:6] != two_families.objects[6:]

    @pytest.mark.parametrize(
        ("change", "says"),
        [
            (
                {"mass_kg": [50.0, 60.0]},
                r"low enough that 6 N \(labels.push_n\) move it",
            ),
            (
                {"colour": 3},
                "family 'crate': unknown key colour; allowed: name.*, count",
            ),
            ({"friction_kinetic": 0.2}, "unknown key friction_kinetic; "),
        ],
    )
    def test_a_family_that_makes_no_sense_is_refused(self, change, says):
        with pytest.raises(InputError, match=says):
            scene(families=[{**FAMILY, **change}])
