"""The loads on a pivoting forearm are the one minimum of a convex energy, or are
refused."""

from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from edge.errors import EdgeError
from tests.train.simulate.scenes import make, one_object, run
from train.simulate.effects import tilt
from train.simulate.pivot_solver import GUARDED_ROUNDS, Pivots, search
from train.simulate.scene_model import Value


def test_newton_on_the_tilt_needs_its_line_search():
    beds, free, c = tilt_cases(600, seed=1)
    answer = tilt_loads(beds, free, c)
    assert tilt_error(beds, free, c, answer).max() < 1e-9
    assert not answer.lost.any()
    loads = tilt_loads(beds, free, c, guarded_rounds=0)
    wrong = tilt_error(beds, free, c, loads) > 1e-6
    assert wrong.sum() >= 1
    assert loads.lost[wrong].all()


def test_a_tilt_that_is_not_found_is_refused(monkeypatch):
    hard = replace(make(one_object(width_m=0.05), "tilt"), taxel_n_m=Value(1e8, 1e8))
    assert run(hard).force.max() > 0.0
    monkeypatch.setattr(tilt, "search", partial(search, guarded_rounds=0))
    with pytest.raises(EdgeError, match="tilt was not found in 2 trials"):
        run(hard)


def test_an_arm_of_one_joint_turns_by_the_root_of_one_equation():
    # Its push and its tilt go together, as on an arm of 20 cm and more, and C has no
    # inverse.
    beds, free, (c00, *_) = tilt_cases(600, seed=2)
    lean = np.linspace(-5.0, 5.0, 600)
    c01 = lean * c00
    answer = tilt_loads(beds, free, (c00, c01, lean * c01))
    assert not answer.lost.any()
    way = c00 * answer.force + c01 * answer.moment

    def missing(way):
        force, moment = bed_loads(beds, free[0] - way, free[1] - lean * way)
        return way - (c00 * force + c01 * moment)

    high = np.abs(missing(0.0))
    low = -high
    for _ in range(200):
        middle = 0.5 * (low + high)
        low = np.where(missing(middle) < 0.0, middle, low)
        high = np.where(missing(middle) < 0.0, high, middle)
    np.testing.assert_allclose(way, 0.5 * (low + high), rtol=0.0, atol=1e-12)
    want = np.array(bed_loads(beds, free[0] - way, free[1] - lean * way))
    soft = beds.stiffness[0] < 1e6
    answered = np.array([answer.force, answer.moment])
    np.testing.assert_allclose(answered[:, soft], want[:, soft], rtol=1e-6, atol=1e-6)


def bed_loads(springs, y0, y1):
    """Force and moment of beds at a depth and a tilt."""
    inside = (y0 + springs.lever * y1 - springs.line_gap)[:, None] - springs.gaps
    force = (np.maximum(inside, 0.0) * springs.stiffness * springs.weight[:, None]).sum(
        axis=1
    )
    return force.sum(axis=0), (force * springs.lever).sum(axis=0)


def tilt_cases(n, seed):
    """Forearms of 16 rows and 7 columns against faces, from soft to very stiff."""
    rng = np.random.default_rng(seed)
    angles = np.radians(15.0 * np.arange(-3, 4))[:, None]
    lever = (np.arange(16) - 7.5)[:, None] * 0.0108 + rng.uniform(-0.04, 0.04, n)
    c00 = 10.0 ** rng.uniform(-3, 0, n)
    c11 = 10.0 ** rng.uniform(-2, 0.5, n)
    springs = SimpleNamespace(
        gaps=np.sort(0.046 * (1.0 - np.cos(angles)), axis=0) + np.zeros(n),
        stiffness=10.0 ** rng.uniform(1, 12, n) + np.zeros((7, 1)),
        line_gap=lever**2 / (2.0 * 10.0 ** rng.uniform(-1, 6, n)),
        weight=np.clip(rng.uniform(-0.5, 1.5, (16, n)), 0.0, 1.0),
        lever=lever,
    )
    free = (rng.uniform(-0.01, 0.1, n), rng.uniform(-0.6, 0.6, n))
    c = (c00, rng.uniform(-0.9, 0.9, n) * np.sqrt(c00 * c11), c11)
    return springs, free, c


def tilt_loads(springs, free, c, guarded_rounds=GUARDED_ROUNDS):
    """The simulator's answers, searched for from no load."""
    n = len(free[0])
    gaps = springs.gaps
    beds = gaps[:, None], springs.stiffness[:, None]
    rows = springs.weight, springs.line_gap, springs.lever
    load = np.zeros((16, n))
    pivots = Pivots(
        lambda depth: beds, *rows, np.ones(n), load, np.array(free), np.array(c)
    )
    (force, moment), _, lost = search(pivots, np.zeros((2, n)), guarded_rounds)
    return SimpleNamespace(force=force, moment=moment, lost=lost)


def tilt_error(springs, free, c, loads):
    """Distance from the one answer, metres at the skin: the step that exact Newton
    would take.

    The energy is strictly convex, so a point with no step left is its minimum.
    """
    y0 = free[0] - (c[0] * loads.force + c[1] * loads.moment)
    y1 = free[1] - (c[1] * loads.force + c[2] * loads.moment)
    inside = (y0 + springs.lever * y1 - springs.line_gap)[:, None] - springs.gaps
    held = (inside > 0.0) * springs.stiffness * springs.weight[:, None]
    force = (inside * held).sum(axis=1)
    k = held.sum(axis=1)
    stiffness = k.sum(axis=0)
    mean = (k * springs.lever).sum(axis=0) / np.where(stiffness > 0.0, stiffness, 1.0)
    spread = (k * (springs.lever - mean) ** 2).sum(axis=0)
    left = force.sum(axis=0) - loads.force
    turning = (force * springs.lever).sum(axis=0) - loads.moment
    r0 = c[0] * left + c[1] * turning
    r1 = c[1] * left + c[2] * turning
    # (I + C H) p = r, about the mean lever, where H is diagonal.
    c01 = c[1] + mean * c[2]
    c00 = c[0] + mean * (c[1] + c01)
    r0 = r0 + mean * r1
    det = (
        1.0
        + c00 * stiffness
        + c[2] * spread
        + (c00 * c[2] - c01 * c01) * stiffness * spread
    )
    p0 = ((1.0 + c[2] * spread) * r0 - c01 * spread * r1) / det
    p1 = ((1.0 + c00 * stiffness) * r1 - c01 * stiffness * r0) / det
    return np.abs(p0 - mean * p1) + 0.1 * np.abs(p1)
