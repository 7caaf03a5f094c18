"""The simulator held against answers that are known."""

from __future__ import annotations

import math
from copy import copy
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from edge.touch.arm import Chain
from train.simulate import arm, base, contact
from train.simulate.convergence import measure
from train.simulate.effects import impact
from train.simulate.effects.sliding import GRAVITY
from train.simulate.effects.tipping import Tipping
from train.simulate.engine import run_batch
from train.simulate.run import kinds
from train.simulate.scene import CODY_START_DEG, CODY_STIFFNESS, Scene, from_dict

ARM_K = 115.0
RADIUS = 0.04604


def one_object(**keys):
    thing = {"name": "thing", "family": "rigid", "conditions": ["fixed"], **keys}
    return [thing]


def make(objects, *add, **trials) -> Scene:
    return from_dict(
        {
            "trials": {"count": 2, **trials},
            "step_s": {"base": 1.0 / trials.get("rate_hz", 100)},
            "effects": {"add": list(add)},
            "object": objects,
        }
    )


def run(scene, step_s=0.01):
    return run_batch(scene, tuple(next(iter(kinds(scene).values()))), step_s)


class TestArm:
    def test_kinematics_are_the_edges(self):
        chain = Chain.cody()
        q = np.random.default_rng(0).uniform(-1.0, 1.0, (chain.dof, 50))
        pose, want = arm.Kinematics(chain).pose(q), chain.pose(q.T)
        np.testing.assert_allclose(pose.origin.T, want[:, :3, 3], atol=1e-15)
        np.testing.assert_allclose(np.moveaxis(pose.rotation, 2, 0), want[:, :3, :3], atol=2e-15)

    def test_kinematics_of_a_skew_chain(self):
        chain = Chain.from_dict(
            {
                "joint": [
                    {"name": "a", "axis": [1, 2, 3], "origin_xyz": [0.1, 0.2, 0.3]},
                    {"name": "f", "type": "fixed", "axis": [1, 0, 0], "origin_rpy": [0.3, 0.2, 1]},
                    {
                        "name": "b",
                        "axis": [0, -1, 0.5],
                        "origin_rpy": [1, 0, 0.4],
                        "translate": [0, 0, 0.2],
                    },
                ]
            }
        )
        q = np.random.default_rng(0).uniform(-1.0, 1.0, (2, 20))
        pose, want = arm.Kinematics(chain).pose(q), chain.pose(q.T)
        np.testing.assert_allclose(pose.origin.T, want[:, :3, 3], atol=1e-15)
        np.testing.assert_allclose(np.moveaxis(pose.rotation, 2, 0), want[:, :3, :3], atol=2e-15)

    def test_the_gains_give_the_stiffness_that_was_measured_at_mid_forearm(self):
        pose = arm.Kinematics(Chain.cody()).pose(np.radians(CODY_START_DEG)[:, None])
        along = pose.rotation[:, 2, 0]
        point = pose.origin[:, 0] + 0.103 * along
        jacobian = np.cross(pose.axes[:, :, 0].T, point - pose.origins[:, :, 0].T)
        push = jacobian[0] - along * (jacobian[0] @ along)
        push /= np.linalg.norm(push)
        compliance = ((jacobian @ push) ** 2 / np.array(CODY_STIFFNESS)).sum()
        assert 1.0 / compliance == pytest.approx(115.0, rel=0.03)

    def test_the_fixed_object_feels_that_stiffness(self):
        batch = run(make(one_object(width_m=0.05)))
        k = np.diff(batch.force[0])[60] * 100.0 / (math.radians(20.0) * 0.43)
        assert k == pytest.approx(115.0, rel=0.15)

    def test_the_forearm_turns_at_the_papers_speed_before_contact(self):
        batch = run(make(one_object(), lead_s=0.3))
        before = batch.joints[0, :25]
        rate = np.diff(before, axis=0) * 100.0
        np.testing.assert_allclose(rate.sum(axis=1), 0.349, atol=1e-3)
        assert (batch.force[0, :29] == 0.0).all()
        assert batch.force[0, 31] > 0.0

    def test_a_damped_joint_answers_a_step_as_its_equation_does(self, tools):
        k, d, h = 20.0, 1.11, 1e-4
        rig = tools.Rig(h=h, arm_k=k, arm_d=d, speed=1e6, travel_s=1e-6, slopes=[[0.0]])
        trace = rig.run(3000)
        want = 1.0 - np.exp(-trace.t[:, 0] * k / d)
        np.testing.assert_allclose(trace.q[:, 0], want, atol=2e-3)

    def test_contact_holds_the_arm_where_the_object_is(self):
        # A rigid, fixed object: the skin's point at the contact does not go on along the push.
        batch = run(make(one_object(width_m=0.05)))
        state = batch.state
        poses = arm.Kinematics(Chain.cody()).pose(batch.joints[0].T)
        point = poses.origin + poses.rotation[:, 2] * state.z[0]
        along = ((point - state.face[:, :1]) * state.normal[:, :1]).sum(axis=0) + RADIUS
        touched = np.flatnonzero(batch.force[0] > 0.0)
        assert np.abs(along[touched]).max() < 2e-3
        one = copy(state)
        one.start = state.start[:, :1]
        free = arm.Kinematics(Chain.cody()).pose(base.equilibrium(one, batch.t[-1]))
        gone = free.origin[:, 0] + free.rotation[:, 2, 0] * state.z[0]
        assert (gone - state.face[:, 0]) @ state.normal[:, 0] + RADIUS > 0.12


class TestSliding:
    MASS, MU_S, MU_K = 2.0, 0.5, 0.4

    def rig(self, tools, h, speed=0.15, **other):
        return tools.Rig(
            h=h,
            speed=speed,
            slopes=[[1e7]],
            effects=("sliding",),
            mass_kg=self.MASS,
            friction_static=self.MU_S,
            friction_kinetic=self.MU_K,
            **other,
        )

    def test_it_sticks_for_mu_n_over_k_v(self, tools):
        trace = self.rig(tools, 1e-3).run(1200)
        start = trace.t[np.argmax(trace.slide[:, 0] > 0.0), 0]
        want = self.MU_S * self.MASS * GRAVITY / (ARM_K * 0.15)
        assert abs(start - want) <= 2e-3

    @pytest.mark.parametrize("speed", [0.02, 0.05])
    def test_it_slips_as_far_as_the_oscillator_says(self, tools, speed):
        normal = self.MASS * GRAVITY
        d = (self.MU_S - self.MU_K) * normal / ARM_K
        omega = math.sqrt(ARM_K / self.MASS)
        tau = 2.0 * (math.pi - math.atan(omega * d / speed)) / omega
        errors = []
        for h in (1e-3, 5e-4):
            trace = self.rig(tools, h, speed).run(round((9.0 - 60.0 * speed) / h))
            moving = trace.speed[:, 0] > 0.0
            start = int(np.argmax(moving))
            stop = start + int(np.argmin(moving[start:]))
            assert stop > start
            errors.append(abs(trace.slide[stop, 0] / (speed * tau + 2.0 * d) - 1.0))
        assert errors[0] < 0.02
        assert errors[1] < errors[0]

    @pytest.mark.parametrize(("mass", "seconds"), [(1.0, 0.2), (5.0, 1.0)])
    def test_the_time_floor_of_looking_movable(self, mass, seconds):
        thing = one_object(
            conditions=["movable"],
            mass_kg=mass,
            friction_static=0.4,
            friction_kinetic=0.35,
            width_m=0.05,
        )
        batch = run(make(thing))
        start = batch.t[np.argmax(batch.traces["slide_m"][0] > 0.0)] - 0.2
        assert start == pytest.approx(seconds, rel=0.25)

    def test_above_six_kilograms_it_does_not_move_in_the_window(self):
        thing = one_object(
            conditions=["movable"], mass_kg=7.0, friction_static=0.4, friction_kinetic=0.35
        )
        batch = run(make(thing))
        assert batch.traces["slide_m"][0, batch.t < 0.2 + 1.2].max() == 0.0

    def test_it_tips_before_it_slides_where_mu_says_so(self):
        height = 0.4
        for mu, tips in ((0.30, False), (0.60, True)):
            thing = one_object(
                conditions=["movable"],
                mass_kg=1.0,
                friction_static=mu,
                friction_kinetic=mu * 0.9,
                base_m=0.36,
                height_m=height,
                width_m=0.05,
            )
            batch = run(make(thing))
            assert bool(batch.state.of(Tipping).tips[0]) is tips
            start = int(np.argmax(batch.traces["slide_m"][0] > 0.0))
            hold = min(mu, 0.36 / (2 * height)) * GRAVITY
            assert batch.force[0, start - 1] <= hold
            assert batch.force[0, start - 1] > 0.9 * hold


class TestRelaxation:
    @pytest.mark.parametrize("tau", [0.05, 0.5, 2.0])
    def test_ramp_and_hold_of_the_standard_linear_solid(self, tools, tau):
        k, ratio, rate, up = 500.0, 1.2, 0.02, 0.5
        rig = tools.Rig(
            h=0.01,
            arm_k=1e12,
            speed=rate,
            travel_s=up,
            slopes=[[k]],
            effects=("relaxation",),
            relax_ratio=ratio,
            relax_s=tau,
        )
        trace = rig.run(150)
        t = trace.t[:, 0]
        ramp = np.minimum(t, up)
        z = ratio * k * rate * tau * (1.0 - np.exp(-ramp / tau)) * np.exp(-(t - ramp) / tau)
        np.testing.assert_allclose(trace.force[:, 0], k * rate * ramp + z, rtol=1e-8)

    def test_foam_never_gives_back_more_than_it_took(self, tools):
        rng = np.random.default_rng(8)
        gaps = np.sort(rng.uniform(0.0, 0.02, (6, 40)), axis=0)
        gaps[0] = 0.0
        slopes, intercepts = contact.sort_bed(gaps, np.full((6, 40), 300.0))
        rig = tools.Rig(
            h=0.01,
            arm_k=1e12,
            speed=0.0,
            slopes=slopes,
            intercepts=intercepts,
            effects=("relaxation",),
            relax_ratio=rng.uniform(0.2, 2.0, 40),
            relax_s=rng.uniform(0.05, 2.0, 40),
        )
        # Presses and lets go at many speeds, always in small steps.
        t = np.arange(2000)[:, None] * 1e-2
        beat = rng.uniform(0.05, 3.0, (3, 1, 40))
        depth = (np.sin(beat * t + rng.uniform(0, 6, (3, 1, 40))) * 0.01).sum(axis=0)
        depth += 0.005 - depth[0]
        taken = np.zeros(40)
        least = np.zeros(40)
        before = force = np.zeros(40)
        for place in np.vstack([np.linspace(0.0, 0.005, 50)[:, None] + np.zeros(40), depth]):
            rig.state.start = place[None]
            now = rig.run(1).force[0]
            assert (now >= 0.0).all()
            taken += 0.5 * (force + now) * (place - before)
            least = np.minimum(least, taken)
            force, before = now, place
        assert (taken > 0.0).all()
        assert (least > -1e-3 * taken).all()


class TestBed:
    def bed(self, rows, columns, depth, *, modulus=10e3, thickness=0.1, curve=None, shift=0.0):
        """Total force and taxels touched of a cylinder on a foundation, as the base lays it."""
        pitch = RADIUS * 2.0 * math.pi / columns
        row_pitch = 0.173 / rows
        z = (np.arange(rows) - (rows - 1) / 2.0)[:, None] * row_pitch
        angles = (np.arange(columns) + 0.5)[:, None] * (2.0 * math.pi / columns)
        away = np.abs((angles - math.pi) - shift * 2.0 * math.pi / columns)
        stiffness = np.where(away < math.pi / 2, modulus * pitch * row_pitch / thickness, 0.0)
        gaps = RADIUS * (1.0 - np.cos(away))
        state = SimpleNamespace(values={"radius_m": np.array([curve or 1e6])})
        depths = depth - base.curve_gap(z, state)
        loads = contact.spring_loads(depths, gaps, stiffness, np.ones((rows, 1)))
        return loads.sum(), (loads > 0.0).sum() * pitch * row_pitch, rows * row_pitch

    @staticmethod
    def cylinder(depth, modulus=10e3, thickness=0.1):
        return (4.0 / 3.0) * (modulus / thickness) * depth * math.sqrt(2.0 * RADIUS * depth)

    @pytest.mark.parametrize(
        ("depth", "low", "high"), [(0.5e-3, 0.54, 1.35), (2e-3, 0.93, 1.08), (5e-3, 0.95, 1.06)]
    )
    def test_sampled_on_taxels_it_keeps_to_the_continuum_law(self, depth, low, high):
        ratios = []
        for shift in np.linspace(-0.5, 0.5, 21):
            force, _, length = self.bed(16, 24, depth, shift=shift)
            ratios.append(force / length / self.cylinder(depth))
        assert low <= min(ratios)
        assert max(ratios) <= high
        if depth < 1e-3:  # the trap: a shallow contact falls between the taxels
            assert max(ratios) / min(ratios) > 1.5

    def test_fine_taxels_give_the_cylinder_law(self):
        force, _, length = self.bed(16, 4800, 3e-3)
        assert force / length == pytest.approx(self.cylinder(3e-3), rel=0.01)

    def test_a_round_thing_across_gives_the_foundations_area_twice_hertz(self):
        # Crossed cylinders of one radius press as a sphere does: F = pi (E/H) R d^2 and
        # area 2 pi R d on a foundation; Hertz's half space has pi R d and d^1.5.
        depth = 3e-3
        force, area, _ = self.bed(600, 1000, depth, curve=RADIUS)
        assert area == pytest.approx(2.0 * math.pi * RADIUS * depth, rel=0.02)
        assert area == pytest.approx(2.0 * (math.pi * RADIUS * depth), rel=0.02)
        assert force == pytest.approx(math.pi * 10e3 / 0.1 * RADIUS * depth**2, rel=0.02)
        twice, _, _ = self.bed(600, 1000, 2 * depth, curve=RADIUS)
        assert math.log2(twice / force) == pytest.approx(2.0, abs=0.05)

    def test_the_closed_form_is_the_bed_in_fractions(self):
        from fractions import Fraction

        rng = np.random.default_rng(11)
        for _ in range(60):
            gaps = np.sort(rng.integers(0, 50, 5)) / 1024.0
            k = 2.0 ** rng.integers(-3, 30, 5)
            c = float(2.0 ** rng.integers(-12, 2))
            free = float(rng.integers(1, 4000)) / 1024.0
            slopes, intercepts = contact.sort_bed(gaps[:, None], k[:, None])
            (force,) = contact.closed_form(
                slopes, intercepts, (np.array([free]),), (np.array([c]),)
            )
            best = Fraction(0)
            total_k = total_b = Fraction(0)
            for g, s in zip(gaps, k, strict=True):
                total_k += Fraction(float(s))
                total_b += Fraction(float(s)) * Fraction(float(g))
                best = max(best, (total_k * Fraction(free) - total_b) / (1 + Fraction(c) * total_k))
            assert force[0] == pytest.approx(float(best), rel=1e-14, abs=1e-300)


class TestImpact:
    def test_the_rebound_is_the_oscillators(self):
        scene = make(one_object(width_m=0.08), "impact", rate_hz=1000, after_s=0.3)
        batch = run(scene, 0.001)
        quiet = run(make(one_object(width_m=0.08), rate_hz=1000, after_s=0.3), 0.001)
        pulse = batch.force[0] - quiet.force[0]
        state = batch.state
        mass, zeta, v = 1.5, 0.3, state.approach[0]
        k = impact.rebound_stiffness(state, 0.5 * mass * state.approach**2)[0]
        t = batch.t - state.of(impact.Impact).touched[0]
        omega = math.sqrt(k / mass)
        want = solve_ivp(
            lambda _, y: [y[1], -2 * zeta * omega * y[1] - omega**2 * y[0]],
            (0.0, 0.3),
            [0.0, v],
            rtol=1e-10,
            atol=1e-13,
            dense_output=True,
        )
        held = (t > 0.0) & (batch.force[0] > 0.0) & (t < 0.29)
        np.testing.assert_allclose(pulse[held], k * want.sol(t[held])[0], atol=1e-6 * k * v / omega)

    def test_its_peak_does_not_depend_on_the_step(self):
        def peak(step_s):
            with_, without = (
                run(make(one_object(width_m=0.08), *add, after_s=0.3), step_s).force[0]
                for add in (("impact",), ())
            )
            return (with_ - without).max()

        assert peak(0.01) == pytest.approx(peak(0.0005), rel=2e-3)
        # The trap: an arm with its mass in the step shows a spike that the step sets.
        assert stepped_spike(1e-4) / stepped_spike(1e-2) > 2.0


def stepped_spike(h, mass=1.5, k=4e4, speed=0.15):
    """Largest force of backward Euler on a mass that runs into a spring."""
    x, v, worst = 0.0, speed, 0.0
    for _ in range(round(0.1 / h)):
        v = (v - h * k / mass * x) / (1.0 + h * h * k / mass)
        x += h * v
        worst = max(worst, k * x)
    return worst


class TestTilt:
    def test_leaving_tilt_out_costs_a_part_of_a_fixed_boxs_force(self):
        flat = run(make(one_object(width_m=0.4))).force[0, -1]
        tilted = run(make(one_object(width_m=0.4), "tilt")).force[0, -1]
        assert 0.10 < abs(tilted / flat - 1.0) < 0.40

    def test_on_a_narrow_bar_the_two_agree_at_first(self):
        flat = run(make(one_object(width_m=0.011))).force[0]
        tilted = run(make(one_object(width_m=0.011), "tilt")).force[0]
        early = slice(25, 50)
        np.testing.assert_allclose(tilted[early], flat[early], rtol=0.05)

    def test_the_image_bears_what_the_arm_pushes(self):
        scene = make(one_object(width_m=0.2), "tilt")
        batch = run(scene)
        total = batch.counts[0].sum(axis=(1, 2)) / 1000.0
        # Each of some dozen taxels is rounded to a count of 1 mN.
        np.testing.assert_allclose(total, batch.force[0], atol=0.05)


class TestConvergence:
    OBJECTS = (
        ("fixed", {}, ()),
        ("movable", {"mass_kg": 1.0, "friction_static": 0.4, "friction_kinetic": 0.35}, ()),
        ("fixed", {"family": "foam", "modulus_pa": 12e3, "depth_m": 0.1}, ()),
    )

    @pytest.mark.parametrize(("condition", "keys", "add"), OBJECTS)
    def test_halving_the_step_halves_the_error(self, condition, keys, add):
        scene = make(one_object(conditions=[condition], width_m=0.05, **keys), *add)
        scene.trials["tolerance"] = 1e-9
        found = measure(scene, tuple(next(iter(kinds(scene).values()))), halvings=4)
        assert found.errors[-1] < found.errors[0]
        assert 0.6 <= found.order <= 4.0
        assert found.errors[-1] < 0.005

    def test_the_step_follows_the_tolerance(self):
        thing = one_object(
            conditions=["movable"], mass_kg=1.0, friction_static=0.4, friction_kinetic=0.3
        )
        scene = make(thing)
        chosen = []
        for tolerance in (0.05, 0.004):
            scene.trials["tolerance"] = tolerance
            found = measure(scene, tuple(next(iter(kinds(scene).values()))))
            within = [
                s for s, e in zip(found.steps_s, found.errors, strict=False) if e <= tolerance
            ]
            assert found.step_s == within[0]
            chosen.append(found.step_s)
        assert chosen[0] > chosen[1]
