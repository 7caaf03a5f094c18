"""The tangential load of taxels: the laws of stick, slip and partial slip, a face that
turns, and that nothing else changes."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from tests.train.simulate.scenes import movable, one_object, run, scene
from train.simulate.effects import shear
from train.simulate.effects.shear import shared
from train.simulate.run import recordings


def box(mu):
    return one_object(skin_friction=mu, width_m=0.05)


def felt(thing, *add, after_s=1.0, axes=3, **effects):
    """A run of two trials, on a skin of three axes."""
    trials = {"count": 2, "after_s": after_s}
    effects = {"add": list(add), **effects}
    return run(scene(thing, effects=effects, trials=trials, skin={"axes": axes}))


def traction(batch):
    """The tangential load along the rows and around the columns, (rows, C, n) each."""
    return shear.traction(batch.trials.everyone)


def water_level(pull: int, limits: list[int]) -> list[Fraction]:
    """Pulls shared by springs, one spring at a time, in fractions."""
    borne = [Fraction(0)] * len(limits)
    remainder = Fraction(pull)
    open_springs = [i for i, limit in enumerate(limits) if limit]
    while open_springs and remainder:
        step = min(
            remainder / len(open_springs),
            min(limits[i] - borne[i] for i in open_springs),
        )
        for i in open_springs:
            borne[i] += step
            remainder -= step
        open_springs = [i for i in open_springs if borne[i] < limits[i]]
    return borne


@settings(max_examples=60)
@given(
    limits=st.lists(st.integers(0, 50), min_size=1, max_size=9),
    part=st.fractions(0, 1),
)
def test_springs_share_a_pull_until_each_slips(limits, part):
    pull = int(part * sum(limits))
    shares = shared(np.array([float(pull)]), np.array(limits, float)[:, None])[:, 0]
    expected = [float(value) for value in water_level(pull, limits)]
    assert shares.tolist() == pytest.approx(expected, abs=1e-12)
    assert shares.sum() == pytest.approx(pull, rel=1e-14)


def test_the_sum_along_the_rows_is_the_pull_that_the_arm_feels():
    batch = felt(box(0.4), "tilt")
    along = traction(batch)[0].sum(axis=(0, 1))
    pull = batch.trials.contact.pull
    assert (np.abs(pull) > 0.01).all()
    assert_allclose(along, pull, rtol=1e-9)


def test_taxels_that_all_slip_bear_friction_times_their_load():
    batch = felt(box(0.05), after_s=4.0)
    touch = batch.trials.touch
    assert (touch.force > 10.0).all()
    # The pull obeys the load of the step before, which is less by its growth.
    along = np.abs(traction(batch)[0])
    assert_allclose(along, 0.05 * touch.image, rtol=5e-3)


def test_a_face_that_turns_takes_the_normal_with_it():
    foam = {"family": "foam", "skin_friction": 1.0, "width_m": 0.2}
    thing = movable(0.3, 0.2, 0.2, aside_m=0.05, foot_m=0.1, **foam)
    batch = felt(thing)
    t = batch.trials
    turned = t.contact.turned
    assert (turned > 0.1).all()
    t.contact.pull[:] = 0.0
    along, around = traction(batch)
    expected = t.touch.image * np.sin(t.bed.column_angle - turned)
    assert np.count_nonzero(expected) > 20
    assert_allclose(around, expected, rtol=1e-12)
    assert not along.any()


def test_nothing_but_the_shear_differs_from_the_scene_without_it():
    add = ("tilt", "noise", "dead_band")
    plain = recordings(felt(box(0.4), *add, axes=1))
    three = recordings(felt(box(0.4), *add))
    pairs = list(zip(plain, three, strict=True))
    assert len(pairs) == 2
    for (_, without), (_, sheared) in pairs:
        assert without.frames.tobytes() == sheared.frames.tobytes()
        assert without.joints.tobytes() == sheared.joints.tobytes()
        assert without.shear is None
        assert sheared.shear.shape == (*without.frames.shape, 2)
        assert sheared.layout.axes == 3


def test_both_axes_have_the_taxels_noise_and_dead_band():
    quiet = {"noise": {"counts": 5.0}}
    (_, noisy), _ = recordings(felt(box(0.0), **quiet))
    spread = noisy.shear.reshape(-1, 2).std(axis=0)
    assert spread == pytest.approx([5.0, 5.0], rel=0.02)
    (_, calm), _ = recordings(felt(box(0.0), **quiet, dead_band={"counts": 30.0}))
    untouched = calm.frames == 0
    assert untouched.sum() > 1000
    assert not calm.shear[untouched].any()


def test_a_dead_taxel_has_no_shear():
    batch = felt(box(0.4), "noise", dead_taxels={"part": 0.2})
    (_, recording), _ = recordings(batch)
    assert not recording.valid.all()
    assert not recording.shear[:, ~recording.valid].any()
    assert recording.shear[:, recording.valid].any()
