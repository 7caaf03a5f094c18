"""The groups that are left out, and the folds of trials."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import train
from edge.record.saving import save
from train.data.groups import fold_count, groupable, kinds_of


def test_whole_objects_can_be_left_out_where_each_class_has_several():
    objects = np.array(list("aabbccddeeff"))
    assert groupable(np.repeat(["x", "y"], 6), objects)
    assert not groupable(np.repeat(["x", "y"], [8, 4]), objects)
    assert not groupable(np.full(12, "x"), objects)


def test_five_folds_are_enough_for_a_quick_choice_and_for_very_many_trials():
    counts = [fold_count(999), fold_count(1000), fold_count(999, quick=True)]
    assert counts == [10, 5, 5]


def drawn_touches(make_touch, kinds=("box", "bin", "post"), numbered=True):
    """{object: a touch of it}, as of a scene with two objects of each kind and
    category."""
    touches = {}
    for seed, (category, kind, i) in enumerate(
        product(("hard", "soft"), kinds, (1, 2))
    ):
        number = f"{i:02d}" if numbered else "ab"[i - 1]
        thing = f"{category} {kind} {number}"
        labels = {"category": category, "object": thing}
        touches[thing] = make_touch(kind=category, seed=seed, labels=labels)
        touches[thing].meta["simulation"] = {}
    return touches


def test_simulated_things_that_a_scene_numbers_are_of_kinds(make_touch):
    touches = drawn_touches(make_touch)
    kinds = kinds_of(list(touches.values()))
    assert kinds.tolist() == [name[:-3] for name in touches]
    assert kinds_of(list(drawn_touches(make_touch, numbered=False).values())) is None
    recorded = replace(touches["hard box 01"], meta={"labels": {"object": "box 03"}})
    assert kinds_of([*touches.values(), recorded]).tolist() == [*kinds, "box 03"]
    assert kinds_of([recorded]) is None


@pytest.mark.parametrize(
    ("kinds", "left_out"),
    [(("box", "bin", "post"), "kind"), (("box", "bin"), "object")],
)
def test_entire_kinds_are_left_out_where_every_class_has_three(
    kinds,
    left_out,
    make_touch,
    tmp_path,
):
    for thing, touch in drawn_touches(make_touch, kinds).items():
        save(tmp_path / f"{thing}.npz", touch)
    fitted = train.fit(str(tmp_path), features=["paper"], projection="pca", jobs=1)
    assert fitted.chosen["category"].held_out == left_out
    assert {
        max(grid.components)
        for candidate in fitted.candidates
        for grid in candidate.grids
    } == {10}
    assert fitted.chosen["object"].held_out == "trial"
