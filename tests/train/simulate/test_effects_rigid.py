"""The simulated arm, and rigid objects that it pushes, held against answers that are
known."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp

from edge.touch.arm import Chain
from tests.train.simulate.scenes import (
    Law,
    make,
    movable,
    one_object,
    press,
    run,
    scene,
    slider,
)
from train.simulate import engine
from train.simulate.arm import Kinematics
from train.simulate.contact import GRAVITY
from train.simulate.effects import friction, sliding
from train.simulate.effects.inertia import FINER
from train.simulate.plan import FRAME

ARM_K = 115.0
RADIUS = 0.04604
SKEW_JOINTS = [
    {"name": "a", "axis": [1, 2, 3], "origin_xyz": [0.1, 0.2, 0.3]},
    {"name": "f", "type": "fixed", "axis": [1, 0, 0], "origin_rpy": [0.3, 0.2, 1]},
    {
        "name": "b",
        "axis": [0, -1, 0.5],
        "origin_rpy": [1, 0, 0.4],
        "translate": [0, 0, 0.2],
    },
]
SKEW = Chain.from_dict({"joint": SKEW_JOINTS})


class TestArm:
    def test_kinematics_are_the_edges(self):
        q = np.random.default_rng(0).uniform(-1.0, 1.0, (SKEW.dof, 50))
        pose = Kinematics(SKEW).pose(q)
        want = SKEW.pose(q.T)
        assert_allclose(pose.origin.T, want[:, :3, 3], atol=1e-15)
        rotation = np.stack(np.broadcast_arrays(*pose.rotation))
        assert_allclose(rotation.T, want[:, :3, :3], atol=2e-15)


class TestSliding:
    MASS = 2.0
    MU_S = 0.5
    MU_K = 0.4

    def test_it_slips_as_far_as_the_oscillator_says(self):
        speed = 0.05
        law = Law([[1e7]])
        normal = self.MASS * GRAVITY
        d = (self.MU_S - self.MU_K) * normal / ARM_K
        omega = math.sqrt(ARM_K / self.MASS)
        tau = 2.0 * (math.pi - math.atan(omega * d / speed)) / omega
        errors = []
        for h in (2e-3, 1e-3):
            rig = slider(h, self.MASS, self.MU_S, self.MU_K, speed=speed, law=law)
            trace = rig.run(round(3.0 / h))
            moving = trace.speed[:, 0] > 0.0
            start = int(np.argmax(moving))
            stop = start + int(np.argmin(moving[start:]))
            assert stop > start
            errors.append(abs(trace.slide[stop, 0] / (speed * tau + 2.0 * d) - 1.0))
        assert errors[0] < 0.02
        assert errors[1] < errors[0]

    def test_it_tips_before_it_slides_where_mu_says_so(self):
        height = 0.4
        for mu, tips in ((0.30, False), (0.60, True)):
            keys = {"base_m": 0.36, "height_m": height, "width_m": 0.05}
            batch = run(make(movable(1.0, mu, mu * 0.9, **keys)))
            assert bool(batch.trials.states["tipping"].tips[0]) is tips
            start = int(np.argmax(batch.traces["slide_m"][0] > 0.0))
            hold = min(mu, 0.36 / (2 * height)) * GRAVITY
            assert batch.force[0, start - 1] <= hold
            assert batch.force[0, start - 1] > 0.9 * hold


class TestInertia:
    """One joint that swings a bar of 0.3 m against a narrow post."""

    INERTIA = 0.09
    STIFFNESS = 12.0
    DAMPING = 0.4

    def swing(self, tmp_path, h, loss_s, after_s=0.6):
        chain = tmp_path / "arm.toml"
        chain.write_text(
            '[[joint]]\nname = "a"\naxis = [0, -1, 0]\ntranslate = [0, 0, -0.4]\n'
        )
        return scene(
            one_object(width_m=0.01),
            trials={"count": 1, "lead_s": 0.05, "after_s": after_s},
            step_s={"base": h},
            motion={"start_deg": [0.0], "rate_deg_s": [30.0]},
            effects={"inertia": {"loss_s": loss_s}},
            arm={
                "chain": str(chain),
                "stiffness_nm_rad": [self.STIFFNESS],
                "damping_nms_rad": [self.DAMPING],
                "inertia_kg_m2": [self.INERTIA],
            },
        )

    def oracle(self, batch, loss_s):
        """I q'' + d q' + k (q - q_eq) = -J F with F = K(a) (a + loss a'), never
        pulling."""
        t = batch.trials
        rate = math.radians(30.0)
        slopes = t.bed.slopes[:, 0]
        intercepts = t.bed.intercepts[:, 0]

        def contact_at(q, speed):
            pose = t.scene.kinematics.pose(np.array([[q]]))
            axis = pose.origin[:, 0] + pose.rotation[2][:, 0] * t.contact.z[0]
            normal = t.contact.normal[:, 0]
            depth = (axis - t.contact.face[:, 0]) @ normal + RADIUS
            lever = np.cross(pose.axes[:, 0, 0], axis) @ normal
            elastic = max((slopes * depth - intercepts).max(), 0.0)
            stiffness = (
                slopes[np.argmax(slopes * depth - intercepts)] if elastic > 0.0 else 0.0
            )
            return max(elastic + loss_s * stiffness * lever * speed, 0.0), lever

        def rates(time, y):
            force, lever = contact_at(*y)
            torque = (
                self.STIFFNESS * (rate * time - y[0])
                - self.DAMPING * y[1]
                - lever * force
            )
            return [y[1], torque / self.INERTIA]

        start = [-self.DAMPING / self.STIFFNESS * rate, rate]
        solution = solve_ivp(
            rates,
            (0, batch.t[-1]),
            start,
            max_step=1e-3,
            rtol=1e-8,
            dense_output=True,
        )
        return np.array([contact_at(*solution.sol(time))[0] for time in batch.t])

    def test_hit_bounce_and_press_are_the_equations(self, tmp_path):
        loss_s = 0.003
        batches = [
            run(self.swing(tmp_path, h, loss_s, after_s=0.25), h) for h in (4e-4, 2e-4)
        ]
        want = self.oracle(batches[0], loss_s)
        errors = [
            np.sqrt(np.mean((b.force[0] - want) ** 2)) / want.max() for b in batches
        ]
        assert errors[1] < 0.1
        assert errors[1] < 0.75 * errors[0]

    def test_steps_are_shorter_near_a_jolt_alone(self, tmp_path, monkeypatch):
        trial_scene = self.swing(tmp_path, 0.01, loss_s=0.02)
        steps = []
        start_frames = engine.start_frames

        def watched(starts):
            start_frames(starts)
            clock = starts.batch.clock
            steps.append(int(clock.steps[0]))
            assert clock.h[0] == 0.01 / steps[-1]

        monkeypatch.setattr(engine, "start_frames", watched)
        hit = int(np.argmax(run(trial_scene).force[0, 1:] > 0.0))
        assert set(steps) == {1, FINER}
        assert set(steps[: hit - 2]) == {1}
        assert set(steps[hit : hit + 3]) == {FINER}
        assert set(steps[hit + 15 : 60]) == {1}


class TestFriction:
    def push(self, t):
        """(3, n) newtons of the arm on the objects."""
        contact = t.contact
        return contact.loads[0] * contact.normal + contact.pull * contact.along_face

    def test_a_sliding_skin_bears_less_by_the_arms_compliance(self):
        # Quasi-static and stiff: a = c_nn F + c_nt T with T = mu F, so F falls by
        # c_nn / (c_nn + mu c_nt).
        mu = 0.4
        plain = press(width_m=0.05)
        held = press(width_m=0.05, skin_friction=mu)
        shear = held.trials.states["friction"]
        pull = held.trials.contact.pull[0]
        force = held.force[0, -1]
        assert abs(pull) == pytest.approx(mu * force, rel=0.02)
        c_nn = held.trials.contact.compliance[0, 0]
        c_nt = shear.coupled[0, 0]
        want = plain.force[0, -1] * c_nn / (c_nn + mu * np.sign(pull) * c_nt)
        assert force == pytest.approx(want, rel=0.05)
        assert force < 0.95 * plain.force[0, -1]

    def test_a_smooth_soft_object_presses_along_the_forearms_normal(self):
        foam = one_object(family="foam", width_m=0.1, skin_friction=0.0)
        t = run(make(foam, "tilt")).trials
        forearm = t.scene.kinematics.pose(t.arm.q_frame).rotation[2]
        askew = (t.contact.normal * forearm).sum(axis=0)
        assert (np.abs(askew) > 0.03).all()
        along = (self.push(t) * forearm).sum(axis=0) / t.contact.loads[0]
        assert_allclose(along, 0.0, atol=0.01)

    def test_askew_the_skin_bears_the_shears_part_along_its_own_normal(self):
        batch = press("tilt", width_m=0.05, skin_friction=0.4)
        t = batch.trials
        forearm = t.scene.kinematics.pose(t.arm.q).rotation[2]
        across = t.contact.normal - forearm * (t.contact.normal * forearm).sum(axis=0)
        across /= np.sqrt((across * across).sum(axis=0))
        want = (self.push(t) * across).sum(axis=0)
        assert_allclose(batch.force[:, -1], want, rtol=2e-3)

    def test_the_shear_cannot_lift_more_than_a_thing_weighs(self):
        held = run(make(movable(0.05, 0.5, 0.5, skin_friction=0.5, width_m=0.2)))
        t = held.trials
        t.contact.pull[:] = 5.0 / t.contact.along_face[2]
        friction.drag(t.everyone)
        sliding.drag(t.everyone)
        assert t.states["sliding"].weight.tolist() == [0.0, 0.0]


class TestTilt:
    def test_depth_and_tilt_follow_the_joints_as_their_jacobians_say(self):
        t = press("tilt", width_m=0.05).trials
        t.everyone.run(*FRAME)
        before = t.contact.y_frame.copy()
        jacobian = t.contact.jacobian.copy()
        middle = t.states["tilt"].lever[0].copy()
        for j in range(4):
            t.arm.q[j] += 1e-6
            t.everyone.run(*FRAME)
            # The point of the forearm that is looked at moves along it; the Jacobian's
            # does not.
            moved = t.contact.y_frame - before
            moved[0] -= before[1] * (middle - t.states["tilt"].lever[0])
            assert_allclose(moved / 1e-6, jacobian[j], atol=2e-5)
            t.arm.q[j] -= 1e-6
