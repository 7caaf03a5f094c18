"""The loads on a pivoting forearm are the one minimum of a convex energy, or are
refused."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from edge.errors import EdgeError
from tests.train.simulate.scenes import make, one_object, run
from train.simulate import pivot_solver
from train.simulate.pivot_solver import Pivots, search
from train.simulate.scene_model import Value


@dataclass
class Beds:
    """Forearms of 16 rows and 7 columns against faces.

    gaps and stiffness (7, n) are those of a row's springs; weight, line_gap and lever
    (16, n) of the rows; free (2, n) and c (3, n) as of `Pivots`.
    """

    gaps: np.ndarray
    stiffness: np.ndarray
    weight: np.ndarray
    line_gap: np.ndarray
    lever: np.ndarray
    free: np.ndarray
    c: np.ndarray

    @classmethod
    def drawn(cls, n, seed):
        """From soft to very stiff."""
        rng = np.random.default_rng(seed)
        angles = np.radians(15.0 * np.arange(-3, 4))[:, None]
        lever = (np.arange(16) - 7.5)[:, None] * 0.0108 + rng.uniform(-0.04, 0.04, n)
        c00 = 10.0 ** rng.uniform(-3, 0, n)
        c11 = 10.0 ** rng.uniform(-2, 0.5, n)
        stiffness = 10.0 ** rng.uniform(1, 12, n)
        line_gap = lever**2 / (2.0 * 10.0 ** rng.uniform(-1, 6, n))
        weight = np.clip(rng.uniform(-0.5, 1.5, (16, n)), 0.0, 1.0)
        free = np.array([rng.uniform(-0.01, 0.1, n), rng.uniform(-0.6, 0.6, n)])
        c01 = rng.uniform(-0.9, 0.9, n) * np.sqrt(c00 * c11)
        return cls(
            gaps=np.sort(0.046 * (1.0 - np.cos(angles)), axis=0) + np.zeros(n),
            stiffness=stiffness + np.zeros((7, 1)),
            weight=weight,
            line_gap=line_gap,
            lever=lever,
            free=free,
            c=np.array([c00, c01, c11]),
        )

    def way(self, loads):
        """(2, n) how far the arm gives way to a force and a moment (2, n)."""
        c00, c01, c11 = self.c
        force, moment = loads
        return np.array([c00 * force + c01 * moment, c01 * force + c11 * moment])

    def springs(self, y):
        """Depth and stiffness (16, 7, n) of the springs touched at y (2, n)."""
        inside = (y[0] + self.lever * y[1] - self.line_gap)[:, None] - self.gaps
        return inside, (inside > 0.0) * self.stiffness * self.weight[:, None]

    def loads(self, y):
        """(2, n) force and moment of the beds at a depth and a tilt y (2, n)."""
        inside, held = self.springs(y)
        force = (inside * held).sum(axis=1)
        return np.array([force.sum(axis=0), (force * self.lever).sum(axis=0)])

    def search(self):
        """The simulator's answers (2, n), searched for from no load, and whether it
        lost them."""
        springs = self.gaps, self.stiffness[None]
        rows = self.weight, self.line_gap, self.lever
        n = self.free.shape[1]
        gain = np.ones(n)
        load = np.zeros((16, n))
        pivots = Pivots(*springs, *rows, gain, load, self.free, self.c)
        loads, _, lost = search(pivots, np.zeros((2, n)))
        return loads, lost

    def error(self, loads):
        """Distance from the one answer, metres at the skin: the step that exact Newton
        would take.

        The energy is strictly convex, so a point with no step left is its minimum.
        """
        y = self.free - self.way(loads)
        _, held = self.springs(y)
        k = held.sum(axis=1)
        moments = [(k * self.lever**power).sum(axis=0) for power in range(3)]
        h = np.moveaxis(np.array(moments)[[[0, 1], [1, 2]]], 2, 0)
        c = np.moveaxis(self.c[[[0, 1], [1, 2]]], 2, 0)
        left = self.way(self.loads(y) - loads).T[..., None]
        step = np.linalg.solve(np.eye(2) + c @ h, left)[..., 0].T
        return np.abs(step[0]) + 0.1 * np.abs(step[1])


def test_newton_on_the_tilt_needs_its_line_search(monkeypatch):
    beds = Beds.drawn(600, seed=1)
    loads, lost = beds.search()
    assert beds.error(loads).max() < 1e-9
    assert not lost.any()
    monkeypatch.setattr(pivot_solver, "GUARDED_ROUNDS", 0)
    loads, lost = beds.search()
    wrong = beds.error(loads) > 1e-6
    assert wrong.sum() >= 1
    assert lost[wrong].all()


def test_a_tilt_that_is_not_found_is_refused(monkeypatch):
    hard = replace(make(one_object(width_m=0.05), "tilt"), taxel_n_m=Value(1e8, 1e8))
    assert run(hard).force.max() > 0.0
    monkeypatch.setattr(pivot_solver, "GUARDED_ROUNDS", 0)
    with pytest.raises(EdgeError, match="tilt was not found in 2 trials"):
        run(hard)


def test_an_arm_of_one_joint_has_its_one_answer_too():
    # Its push and its tilt go together, as on an arm of 20 cm and more, and C has no
    # inverse.
    beds = Beds.drawn(600, seed=2)
    c00 = beds.c[0]
    lean = np.linspace(-5.0, 5.0, 600)
    c01 = lean * c00
    beds = replace(beds, c=np.array([c00, c01, lean * c01]))
    loads, lost = beds.search()
    assert beds.error(loads).max() < 1e-9
    assert not lost.any()
