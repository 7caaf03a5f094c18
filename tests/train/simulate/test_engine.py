"""No effect and no pair of effects makes energy: a ledger of every step.

The equilibrium point's motion is all that puts energy in. In each step of a joint,
backward Euler's I (v+ - v) / h + d v+ + k (q+ - q_eq) = -tau leaves tau dq to the
contact, whatever its effects are: nothing in free motion, and never less than nothing
in sum. The speed and the lean of a pushed object take no more than the contact took.
"""

from itertools import chain

import numpy as np
import pytest

from edge.errors import EdgeError
from tests.train.simulate.scenes import make, one_object, run, scene, specs_of
from train.simulate import engine
from train.simulate.plan import Call, kinds, make_plan
from train.simulate.schema import CONTACT_EFFECTS, EFFECTS

RANGES = {
    "stem_height_m": [0.3, 0.6],
    "stem_kg": [0.005, 0.1],
    "mass_kg": [0.02, 1.0],
    "friction_static": [0.5, 1.1],
    "friction_kinetic": [0.1, 0.5],
    "skin_friction": [0.2, 1.5],
    "cover_n_m": [200.0, 1e4],
    "stribeck_m_s": [0.01, 0.1],
    "base_m": [0.05, 0.3],
    "height_m": [0.2, 0.6],
    "foot_m": [0.1, 0.4],
    "aside_m": [-0.1, 0.1],
    "slope_deg": [-10.0, 10.0],
    "width_m": [0.03, 0.3],
}
"""Values such that objects slide, tip, turn, bounce and slip."""
OWN_RANGES = {
    "foam": {
        "modulus_pa": [1e3, 2e4],
        "depth_m": [0.02, 0.2],
        "relax_ratio": [0.2, 10.0],
        "relax_s": [0.01, 1.0],
    },
    "bubbles": {
        "bubble_n_m": [300.0, 3000.0],
        "bubble_m": [0.004, 0.02],
        "pop_n": [0.5, 5.0],
    },
    "foliage": {
        "stem_n_m": [5.0, 50.0],
        "stem_slip_m": [0.02, 0.1],
        "stem_damping": [0.05, 1.0],
    },
}
CONTACT = list(CONTACT_EFFECTS)
MOVES = ("mass_kg", "friction_static", "friction_kinetic")
ROUNDING = 1e-9
"""As a part of all that went to and fro."""


class Ledger:
    """Joules, step by step: those that the arm gave the contact, and the contact the
    object."""

    def __init__(self, scene, specs, meddle=None):
        """Of a scene's trials; `meddle` changes them after each step."""
        self.scene = scene
        self.specs = specs
        self.meddle = meddle
        plan = make_plan(scene, specs)
        book = Call("ledger", self.book, np.ones(len(specs), dtype=bool))
        self.plan = plan.with_hooks(settle=[*plan.stages["settle"], book])
        self.inertia = (
            np.array(scene.inertia)[:, None] if "inertia" in plan.calls else 0.0
        )
        self.took = []
        self.idle = []
        self.pushed = []
        self.has = []
        self.q = None

    def run(self):
        """(n, frames) newtons of the trials, with every step booked."""
        return engine.run_physics(self.scene, self.specs, plan=self.plan).force

    def book(self, active):
        """Book the work of this step, for the trials that took it."""
        t = active.batch
        if self.q is None:
            self.q = t.everyone.equilibrium(0.0) - t.arm.lag
            self.slide = np.zeros(t.n)
            self.v = t.arm.rate
            self.speed = np.zeros(t.n)
        if self.meddle:
            self.meddle(t)
        moved = np.zeros(t.n, dtype=bool)
        moved[active.places] = True
        dq = t.arm.q - self.q
        load = t.contact.loads[0]
        v = np.where(moved, dq / t.clock.h, self.v)
        spring = t.joints.stiffness * (t.arm.q - t.everyone.equilibrium(t.clock.t))
        torque = self.inertia * (v - self.v) / t.clock.h + t.joints.damping * v + spring
        self.took.append(-(torque * dq).sum(axis=0))
        self.q = t.arm.q.copy()
        self.v = v
        idle = load == 0.0
        if "viscous" in t.states:
            idle = idle & (np.abs(t.bed.load).max(axis=0) < 1e-6)
        if "sliding" in t.states:
            mover = t.states["sliding"]
            way = mover.slide - self.slide
            self.slide = mover.slide.copy()
            self.pushed.append(load * way)
            self.speed = np.where(moved, way / t.clock.h, self.speed)
            has = 0.5 * mover.inertia * self.speed * self.speed + lean(t, mover)
            self.has.append(has)
            idle = idle & (has == 0.0)
        self.idle.append(idle)

    def judge(self, effects):
        """Fail where energy came out of nothing."""
        took = np.cumsum(self.took, axis=0)
        scale = np.cumsum(np.abs(self.took), axis=0) + 1e-3
        # Where nothing is borne or moves nothing is stored: there a new account begins.
        idle = np.maximum.accumulate(np.where(self.idle, took, 0.0), axis=0)
        first = np.argmin(self.idle, axis=0)
        before = [np.abs(took[:k, i]).max() for i, k in enumerate(first)]
        assert max(before) <= ROUNDING, f"{effects}: the arm alone made or lost energy"
        assert (took - idle >= -ROUNDING * scale).all(), (
            f"{effects}: gave back more than it took"
        )
        if self.pushed:
            pushed = np.cumsum(self.pushed, axis=0)
            assert (np.array(self.has) <= pushed + ROUNDING * scale).all(), (
                f"{effects}: moves by itself"
            )


def lean(t, mover):
    """The energy stored in the lean of an object that tips; beyond the balance it gives
    it back."""
    if "tipping" not in t.states:
        return 0.0
    state = t.states["tipping"]
    stored = state.force * (mover.slide - mover.slide**2 / (2.0 * state.travel))
    return np.where(state.tips, stored, 0.0)


def pair_scene(first, second):
    """A scene whose object calls for two effects, and for nothing that neither they nor
    its family need; None where no object can have both."""
    pair = {first, second, *EFFECTS[first].needs, *EFFECTS[second].needs}
    families = [set(EFFECTS[n].families) for n in pair if EFFECTS[n].families]
    common = sorted(set.intersection(*families or [{"rigid"}]))
    if not common:
        return None
    keys = chain(*(EFFECTS[name].keys for name in pair))
    keys = {key: RANGES[key] for key in ("width_m", *MOVES, *keys)}
    family = common[0]
    condition = "movable" if "sliding" in pair else "fixed"
    thing = {"name": "thing", "family": family, "conditions": [condition], **keys}
    trial_scene = scene(
        [{**thing, **OWN_RANGES.get(family, {})}],
        trials={"count": 6, "lead_s": 0.1, "after_s": 0.7},
        spread={"place_m": 0.02, "yaw_deg": 3.0},
        effects={"add": sorted(pair - {"shear"})},
        skin={"axes": 3 if "shear" in pair else 1},
    )
    assert pair <= set(next(iter(kinds(trial_scene)))), pair
    return trial_scene


@pytest.mark.parametrize("step_s", [0.01, pytest.param(0.0025, marks=pytest.mark.slow)])
@pytest.mark.parametrize("first", CONTACT)
def test_no_effect_and_no_pair_of_them_makes_energy(first, step_s):
    for second in CONTACT[CONTACT.index(first) :]:
        if (trial_scene := pair_scene(first, second)) is None:
            continue
        ledger = Ledger(trial_scene, specs_of(trial_scene, step_s))
        assert (ledger.run().max(axis=1) > 0.0).all(), (first, second)
        ledger.judge((first, second))


def test_the_ledger_notices_a_contact_that_gives_back_more_than_it_took(monkeypatch):
    trial_scene = pair_scene("inertia", "tilt")

    def push(t):
        t.arm.q[:, t.contact.loads[0] > 0.0] -= 1e-3

    monkeypatch.setattr(engine, "check_energy", lambda *_: None)
    ledger = Ledger(trial_scene, specs_of(trial_scene), push)
    ledger.run()
    with pytest.raises(AssertionError, match="gave back more"):
        ledger.judge("pushed")


def test_a_run_that_makes_energy_is_refused():
    trial_scene = make(one_object(), lead_s=0.1)
    batch = run(trial_scene)
    engine.check_energy(batch.trials, batch.joints, batch.t)
    # Nor can it shake: its damping takes more than is put in.
    for every, turned, when in ((1, -1.0, ": at 1 s"), (2, 0.02, "")):
        joints = batch.joints.copy()
        joints[1, 100::every, 0] += turned
        with pytest.raises(
            EdgeError, match=f"trial 1 of thing-fixed makes energy{when}"
        ):
            engine.check_energy(batch.trials, joints, batch.t)
