"""The automatic step: a much shorter step confirms the error that it claims."""

from dataclasses import replace

import numpy as np
import pytest

from tests.train.simulate.scenes import make, movable
from train.simulate.convergence import kinds, measure
from train.simulate.engine import run_physics


def test_halving_the_step_halves_the_error():
    scene = make(movable(1.0, 0.4, 0.35, width_m=0.05))
    scene.trials["tolerance"] = 5e-4
    (convergence,) = measure(scene, kinds(scene)).values()
    assert convergence.errors[-1] < 0.7 * convergence.errors[-2]
    assert convergence.errors[-1] < 0.005
    # So the reference run errs by about as much as its last halving changed.
    assert convergence.change <= 5e-4


@pytest.mark.slow
def test_a_light_object_that_swings_within_a_step_is_not_within_the_tolerance():
    # From three halvings alone, 2.5 ms would err by 5e-5; the thing swings ten times in
    # that.
    scene = make(movable(1e-4, 0.5, 0.4), lead_s=0.05, after_s=0.15)
    groups = kinds(scene)
    (trials,) = groups.values()
    (convergence,) = measure(scene, groups).values()
    assert not convergence.within
    true, step = (
        run_physics(
            scene, tuple(replace(trial, step_s=step_s) for trial in trials)
        ).force
        for step_s in (4e-5, convergence.step_s)
    )
    assert convergence.error >= 0.9 * np.sqrt(np.mean((step - true) ** 2)) / true.max()


def test_the_step_follows_the_tolerance():
    scene = make(movable(1.0, 0.4, 0.3), after_s=0.5)
    chosen = []
    for tolerance in (0.05, 0.004):
        scene.trials["tolerance"] = tolerance
        (convergence,) = measure(scene, kinds(scene)).values()
        errors = dict(zip(convergence.steps_s, convergence.errors, strict=False))
        assert convergence.step_s == next(s for s in errors if errors[s] <= tolerance)
        chosen.append(convergence.step_s)
    assert chosen[0] > chosen[1]
