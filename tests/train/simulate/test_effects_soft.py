"""Simulated foam held against answers that are known: its creep, its bed, its layer."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import solve, toeplitz

from tests.train.simulate.scenes import Law, Rig, make, one_object, press, run
from train.simulate import contact
from train.simulate.effects import cover, lateral
from train.simulate.scene_model import Value

RADIUS = 0.04604


class TestRelaxation:
    @pytest.mark.parametrize("tau", [1e-6, 0.05, 1e5])
    def test_ramp_and_hold_of_the_standard_linear_solid(self, tau):
        k = 500.0
        ratio = 1.2
        rate = 0.02
        up = 0.5
        push = {"arm_k": 1e12, "speed": rate, "travel_s": up}
        solid = {"relax_ratio": ratio, "relax_s": tau}
        rig = Rig([0.01, 0.002, 0.1], Law([[k]]), ("relaxation",), **push, **solid)
        trace = rig.run(150)
        t = trace.t
        ramp = np.minimum(t, up)
        rise = 1.0 - np.exp(-ramp / tau)
        z = ratio * k * rate * tau * rise * np.exp(-(t - ramp) / tau)
        assert_allclose(trace.force, k * rate * ramp + z, rtol=1e-8)


def layer_solution(half_width):
    """Load and depth of a cylinder of radius 1 on a bonded layer of E = 1 and H = 1
    without lateral strain, by its Green's function (Fourier), half_width a."""
    n = 8192
    step = 1 / 200
    w = 2.0 * np.pi * np.fft.rfftfreq(n, step)
    v = np.clip(w, 1e-9, 20.0)
    bonded = (6.0 * np.sinh(2 * v) - 4.0 * v) / (
        6.0 * np.cosh(2 * v) + 4.0 * v**2 + 10.0
    )
    u = 2.0 * np.where(w > 20.0, 1.0, bonded) / np.maximum(w, 1e-9)
    u[0] = 1.0
    green = np.fft.irfft(u, n) / step
    points = 2 * round(half_width / step) + 1
    x = (np.arange(points) - points // 2) * step
    flat, curved = solve(
        toeplitz(green[:points]), np.stack([np.ones(points), x * x / 2.0]).T
    ).T
    depth = curved[0] / flat[0]  # no pressure at the edge
    return (depth * flat - curved).sum(), depth


class TestLateral:
    def test_the_bed_of_taxels_keeps_to_it(self):
        foam = one_object(family="foam", modulus_pa=12e3, depth_m=0.1, relax_ratio=0.0)
        batch = run(make(foam))
        depth = batch.traces["depth_m"][0, -1] / 0.1
        parts_of_depth = (0.2, 0.3, 0.4)
        loads, depths = zip(*map(layer_solution, parts_of_depth), strict=True)
        scale = RADIUS / 0.1
        want = np.interp(depth * scale, depths, loads) / scale
        length = batch.trials.scene.skin.pitch[0] * batch.trials.bed.weight[:, 0].sum()
        assert batch.force[0, -1] == pytest.approx(12e3 * 0.1 * want * length, rel=0.1)


class TestAskew:
    """Over the end of a foam block of 8 kPa, 0.1 m thick, against an elastic block of
    that size by finite elements (linear bricks of 8 mm, bonded behind, no friction,
    Poisson's ratio 0.1)."""

    def test_rows_bear_the_loads_of_an_elastic_block(self):
        """At 17 degrees, 25.5 mm deep."""
        rows = [1.828, 1.454, 1.086, 0.786, 0.522, 0.258]
        foam = one_object(family="foam", modulus_pa=8e3, depth_m=0.1, relax_ratio=0.0)
        t = run(make(foam)).trials
        slope = np.tan(np.radians(17.0))
        pitch = t.scene.skin.pitch[0]
        # The face covers the skin's rows but the first and the last.
        depth = 0.0255 - slope * (np.arange(16) - 0.5) * pitch
        t.bed.weight[:] = np.pad(np.ones(14), 1)[:, None]
        t.touch.line_depth[:] = depth[:, None]
        t.touch.force[:] = 6.0
        # Half a column from the nearest on either side, as in the block's sum over
        # taxels.
        columns = len(t.bed.columns)
        angles_off = (np.arange(columns) - columns // 2 + 0.5) * 0.26166
        radius = t.scene.skin.radius_m
        gaps = lateral.touched_at(radius * (1.0 - np.cos(angles_off)), radius, 0.1)
        t.bed.column_gaps[:] = gaps[:, None]
        lateral.image(t.everyone)
        image = t.touch.image[..., 0]
        borne = image.sum(axis=1)[1:7]
        assert borne.sum() == pytest.approx(sum(rows), rel=0.06)
        assert borne == pytest.approx(rows, abs=0.16 * max(rows))
        assert image.max() == pytest.approx(0.445, rel=0.1)


def test_foam_pressed_flat_is_as_hard_as_the_skin():
    # 20 mm at 2 kPa: its column ends at 93 %, and then the taxel is all that gives.
    foam = {"family": "foam", "modulus_pa": 2e3, "depth_m": 0.02}
    batch = run(make(one_object(**foam), after_s=4.0))
    depth = batch.traces["depth_m"][0]
    force = batch.force[0]
    give = np.diff(depth)[-50:] / np.diff(force)[-50:]
    assert (give > 0.0).all()
    assert (give <= 1.0 / (16 * 1e4)).all()
    assert 0.93 * 0.02 < depth.max() < 0.022


def test_a_sleeve_gives_each_of_four_neighbours_its_part():
    t = press(cover_n_m=2500.0, cover_spread=0.1).trials
    t.touch.image[:] = 0.0
    t.touch.image[5, 3] = 1.0
    t.touch.image[0, 8] = 1.0
    cover.pass_on(t.everyone)
    image = t.touch.image[..., 0]
    want = np.zeros_like(image)
    want[5, 3] = 0.6
    want[[4, 6], 3] = 0.1
    want[5, [2, 4]] = 0.1
    want[0, 8] = 0.7  # none is lost beyond the skin's end
    want[1, 8] = 0.1
    want[0, [7, 9]] = 0.1
    assert_allclose(image, want, atol=1e-15)


class TestBubbles:
    HEIGHT = 0.008
    STIFFNESS = 1500.0

    def wrap(self, **keys):
        bubbles = {"bubble_m": self.HEIGHT, "bubble_n_m": self.STIFFNESS}
        return make(one_object(family="bubbles", **bubbles, **keys))

    @pytest.mark.parametrize("part", [0.25, 0.5, 0.75])
    def test_they_stiffen_by_the_gas_law(self, part):
        # f = k0 d / (1 - d / b), touched by its tangents at b / 2 and 3 b / 4.
        rigid = replace(self.wrap(pop_n=1e6), taxel_n_m=Value(1e12, 1e12))
        t = run(rigid).trials
        bed = t.bed
        columns = len(t.bed.reach)
        middle = slice(columns // 2, None, columns)
        touched = bed.gaps[middle, 0][:3]
        stiffness = bed.stiffness[middle, 0][:3]
        depth = part * self.HEIGHT
        force = (np.maximum(touched[0] + depth - touched, 0.0) * stiffness).sum()
        want = self.STIFFNESS * depth / (1.0 - part)
        assert force == pytest.approx(want if part >= 0.5 else 0.75 * want, rel=1e-6)

    def test_burst_ones_leave_their_backing(self):
        batch = run(self.wrap(pop_n=0.5))
        alive = batch.trials.bed.intact
        alive = alive.reshape(4, -1, *alive.shape[1:])
        burst = alive[3] == 1.0
        assert burst.any()
        assert not burst.all()
        assert (alive[:3, burst] == 0.0).all()
        assert (alive[:3, ~burst] == 1.0).all()
        # Nothing bears there until it is pressed through the bubble's height.
        assert batch.traces["depth_m"][0, -1] > self.HEIGHT


def test_the_stems_that_are_held_bear_by_their_own_bends():
    keys = {"stem_slip_m": 0.03, "stem_spread_m": 0.5, "stem_damping": 0.0}
    batch = press(family="foliage", **keys)
    stems = batch.trials.states["stems"]
    bent = np.maximum(batch.trials.contact.depth[0] - stems.depth, 0.0)
    assert (bent > 0.03).any()
    assert (stems.stiffness[bent > 0.03] == 0.0).all()
    want = (stems.stiffness * bent).sum(axis=0)
    assert (want > 0.1).all()
    assert_allclose(batch.force[:, -1], want, rtol=1e-9)
    # Between two rows, each stem's load is nearer to the one that it stands nearer to.
    row = stems.taxel // len(batch.trials.bed.columns) + stems.part
    middle = (row * stems.stiffness * bent).sum(axis=0) / want
    counts = batch.counts[:, -1].sum(axis=2, dtype=float)
    measured = (counts * np.arange(16)).sum(axis=1) / counts.sum(axis=1)
    assert_allclose(measured, middle, atol=0.01)


def upright(**keys):
    plant = {"family": "foliage", "stem_slip_m": 1.0, "stem_spread_m": 0.0}
    return press(**{**plant, "stem_height_m": 0.3, **keys})


def test_upright_stems_are_lines_beside_a_cylinder():
    batch = upright(stem_count=40, breadth_m=0.2)
    trials = batch.trials
    stems = trials.states["stems"]
    met = stems.stiffness > 0.0
    # Those farther to the side than the radius miss: all but 92 of 200 mm.
    assert 0.3 < met.mean() < 0.6
    column = (stems.taxel % len(trials.bed.columns))[met]
    angle = trials.bed.column_angle[column, np.nonzero(met)[1]]
    # The first that is met stands nearly in the middle; others follow by R (1 - cos),
    # to within the columns' pitch of 15 degrees.
    assert stems.depth[met].min() == 0.0
    assert_allclose(stems.depth[met], RADIUS * (1.0 - np.cos(angle)), atol=0.007)
    assert "upright" in trials.plan.calls
    pressed = (batch.counts > 0).any(axis=1)
    assert pressed[:, -1].any()
    assert not pressed[:, :-1].any()


def test_a_stem_is_stiffer_by_the_square_of_the_height_at_which_it_is_pushed():
    middle = {"stem_count": 1, "breadth_m": 1e-6, "stem_deviation": 0.0}
    low, high = (
        upright(stem_height_m=height, **middle).trials for height in (0.3, 3.0)
    )
    scene = low.scene
    below = scene.place_m - scene.skin.row_z[-1, 0]
    for trials, height in ((low, 0.3), (high, 3.0)):
        stiffness = trials.values["stem_n_m"] * (height / (height - below)) ** 2
        assert_allclose(trials.states["stems"].stiffness[0], stiffness, rtol=1e-12)


def test_a_stem_that_is_struck_takes_its_momentum_on_average():
    light = {"stem_count": 1, "stem_n_m": 1e-6, "stem_damping": 0.0}
    stem = one_object(family="foliage", stem_kg=1e-3, stem_slip_m=1.0, **light)
    batch = run(make(stem, count=100, after_s=0.1, lead_s=[0.2, 0.3]))
    impulse = batch.force.sum(axis=1) * 0.01
    speed = np.diff(batch.traces["depth_m"][:, -2:])[:, 0] / 0.01
    part = impulse / (1e-3 * speed)
    assert "strike" in batch.trials.plan.calls
    assert part.mean() == pytest.approx(1.0, abs=0.1)


def loads_of(t):
    """The elastic load of each spring at the rows' depths."""
    bed = t.bed
    return contact.spring_loads(t.touch.line_depth, bed.gaps, bed.stiffness, bed.weight)


def test_under_a_pivoting_arm_the_springs_that_are_left_bear_by_their_depth():
    wrap = one_object(family="bubbles", pop_n=0.3, width_m=0.08)
    t = run(replace(make(wrap, "tilt", after_s=2.0), travel_s=0.6)).trials
    intact = t.bed.intact
    assert (np.ptp(intact.sum(axis=0), axis=0) > 0.0).all()
    want = (loads_of(t) * intact).sum(axis=0)
    assert_allclose(t.bed.row_force, want, atol=1e-6)
