"""Objects pushed beside their middle turn, slopes help or hinder, and tipped objects
fall."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.train.simulate.scenes import make, one_object, run
from train.simulate import scene as scenes
from train.simulate.contact import GRAVITY
from train.simulate.effects import stribeck
from train.simulate.engine import run_physics
from train.simulate.plan import kinds, make_plan

CODY18 = Path(scenes.__file__).parents[1] / "scenes" / "cody18.toml"

MU = 0.4
MASS = 1.0
AT_THE_END = slice(-40, None)


def push(**keys):
    """A box of even friction that the arm pushes, and its batch of one trial."""
    even = {
        "width_m": 0.05,
        "mass_kg": MASS,
        "friction_static": MU,
        "friction_kinetic": MU,
    }
    box = one_object(conditions=["movable"], **{**even, **keys})
    return run(make(box, count=1, after_s=1.8), 0.0025)


class TestTurning:
    def test_an_off_centre_push_needs_less_and_turns_it(self):
        aside = -0.06
        batch = push(aside_m=aside, foot_m=0.24)
        lever = 2.0 / 3.0 * 0.12
        force = MU * MASS * GRAVITY / math.sqrt(1.0 + (aside / lever) ** 2)
        assert batch.force[0, AT_THE_END].mean() == pytest.approx(force, rel=0.02)
        turned = batch.traces["turn_rad"][0, -1]
        slid = batch.traces["slide_m"][0, -1]
        assert turned == pytest.approx(slid * aside / (lever**2 + aside**2), rel=1e-12)

    def test_the_contact_moves_around_the_forearm_with_the_face(self):
        straight = push(aside_m=0.0, foot_m=0.24)
        turned = push(aside_m=0.06, foot_m=0.24)

        def column(batch):
            weight = batch.counts[0, -1].sum(axis=0, dtype=float)
            return (weight * np.arange(24)).sum() / weight.sum()

        columns = turned.traces["turn_rad"][0, -1] / math.radians(15.0)
        assert columns > 1.0
        assert column(turned) - column(straight) == pytest.approx(columns, abs=0.15)
        total = turned.counts[0].sum(axis=(1, 2)) / 1000.0
        np.testing.assert_allclose(total, turned.force[0], atol=0.05)


class TestSlope:
    @pytest.mark.parametrize(
        ("degrees", "mu", "keys", "rel"),
        [
            (1.0, MU, {}, 0.02),
            (1.0, 0.2, {"friction_kinetic": 0.2, "stribeck_m_s": 0.01}, 0.1),
        ],
    )
    def test_uphill_takes_more_and_downhill_less(self, degrees, mu, keys, rel):
        """Also where friction falls with speed."""
        angle = math.radians(degrees)
        force = MASS * GRAVITY * (mu * math.cos(angle) + math.sin(angle))
        batch = push(slope_deg=degrees, **keys)
        assert batch.force[0, AT_THE_END].mean() == pytest.approx(force, rel=rel)

    def test_friction_falls_with_the_square_of_the_speed(self):
        t = push(friction_static=0.6, friction_kinetic=0.2, stribeck_m_s=0.05).trials
        mover = t.states["sliding"]
        mover.speed[:] = 0.1
        stribeck.drag(t.everyone)
        friction = 0.2 + 0.4 * math.exp(-4.0)
        assert mover.resist[0] == pytest.approx(friction * MASS * GRAVITY, rel=1e-12)


class TestToppling:
    @pytest.fixture
    def batch(self):
        return push(mass_kg=0.8, friction_static=0.9, base_m=0.08, height_m=0.4)

    def test_it_turns_about_its_edge_as_a_box_does_then_lies_and_stays(self, batch):
        # m (b^2 + (2 h)^2) / 3 about an edge, felt at the height h.
        felt = 0.8 * (0.08**2 + 0.8**2) / 3.0 / 0.4**2
        assert batch.trials.states["sliding"].inertia[0] == pytest.approx(
            felt, rel=1e-12
        )
        slide = batch.traces["slide_m"][0]
        lies = 0.5 * math.pi * 0.4
        fallen = slide >= lies - 1e-12
        assert fallen.any()
        assert (slide[np.argmax(fallen) :] == lies).all()


def test_what_slides_at_the_skin_bears_force_at_every_step_of_a_frame():
    """Were the contact located once a frame, it would jump there, and the skin's loss
    would let go of what it presses."""
    cody18 = scenes.load(CODY18)
    trials = {**cody18.trials, "after_s": 1.1}
    level_scene = replace(cody18, spread={}, trials=trials)
    of_kind = (specs for specs in kinds(level_scene).values())
    every = [replace(spec, step_s=1e-3) for specs in of_kind for spec in specs]
    spec = next(spec for spec in every if spec.key == "plastic-bin-movable")
    plan = make_plan(level_scene, (spec,)).with_hooks(pace=[])
    *hooks, last = plan.stages["settle"]
    forces = []

    def settle(t):
        last.function(t)
        forces.append(float(t.contact.loads[0, 0]))

    plan = plan.with_hooks(settle=[*hooks, replace(last, function=settle)])
    run_physics(level_scene, (spec,), plan=plan, images=False)

    first = int(np.argmax(np.array(forces) > 0.0))
    sliding = np.array(forces[first + 200 : first + 900])
    assert sliding.min() > 2.0
    assert sliding.max() < 3.5
