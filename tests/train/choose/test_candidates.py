"""The candidates, and their order of cost."""

import numpy as np
import pytest

from tests.train.model.test_agreement import TASKS
from train.choose.candidates import (
    PLAIN,
    WITH_JOINTS,
    WITH_SHEAR,
    candidates,
    costs,
)
from train.choose.options import FitOptions
from train.data.feature_sets import expand
from train.model.pipeline import Choice
from train.model.scaling import BY_COLUMN


def test_all_tasks_side_by_side_are_tried_but_not_for_drawn_things():
    """Category is left out, as its factors are there."""
    together = ("mobility", "object", "softness")
    y = {task: np.tile(labels, 2) for task, labels in TASKS.items()}
    y["object"] = np.arange(8).astype(str)
    plain, drawn = (
        {
            grid.targets
            for candidate in candidates(y, drawn=d)
            for grid in candidate.grids
        }
        for d in (False, True)
    )
    assert plain == {(), together}
    assert drawn == {()}


def test_columns_are_scaled_too_where_motions_of_joints_stand_beside_other_features():
    y = {**TASKS, "object": np.array(["a", "b", "c", "d"])}
    scalings = {
        (grid.scaling, "joints" in candidate.name, bool(grid.targets))
        for candidate in candidates(y, joints=True)
        if not candidate.known
        for grid in candidate.grids
    }
    assert (BY_COLUMN, True, True) in scalings
    assert not {(BY_COLUMN, True, False), (BY_COLUMN, False, True)} & scalings


def sets_of(known=False, quick=False, **words):
    """The feature sets that are candidates, for known objects alone or for all."""
    every = candidates(TASKS, FitOptions(quick=quick), **words)
    return {c.sets for c in every if c.known == known}


WITH_BOTH = {(*sets, "joints") for sets in WITH_SHEAR}


@pytest.mark.parametrize(
    ("words", "sets"),
    [
        ({}, {*PLAIN}),
        ({"joints": True}, {*WITH_JOINTS}),
        ({"joints": True, "shear": True}, {*WITH_JOINTS, *WITH_BOTH}),
        ({"shear": True}, {*PLAIN, *WITH_SHEAR}),
        ({"shear": True, "quick": True}, {*PLAIN[:3], *WITH_SHEAR}),
    ],
)
def test_features_of_joints_and_shear_are_candidates_where_recordings_have_them(
    words, sets
):
    assert sets_of(**words) == sets


def test_each_group_of_features_is_tried_beside_every_other_for_known_things():
    known = sets_of(known=True, joints=True, shear=True)
    assert ("taxels", "shear", "taxel_shear", "joints", "posture") in known
    assert ("kernels", "joints", "posture") in known
    assert known.isdisjoint(sets_of(joints=True, shear=True))
    assert not sets_of(known=True, joints=True, quick=True)


def test_every_feature_set_but_the_papers_is_tried_with_both_projections():
    combinations = {
        (candidate.sets, candidate.projection)
        for candidate in candidates(TASKS)
        if not candidate.known
    }
    usual = {(sets, kind) for sets in PLAIN for kind in ("pca", "lda")}
    assert combinations == usual - {(("paper",), "lda")}


def test_settings_that_are_fixed_are_held():
    (candidate,) = candidates(
        TASKS,
        FitOptions(
            features=["paper"], projection="pca", scaling="V", components=3, k=2
        ),
    )
    (grid,) = candidate.grids
    assert candidate.name == "paper"
    assert grid.features == expand(["paper"])
    assert grid.projection == "pca"
    assert grid.scaling == "V"
    assert grid.components == (3,)
    assert grid.neighbours == (2,)


@pytest.mark.parametrize(
    ("joints", "sets"), [(False, ("contact",)), (True, ("contact", "joints"))]
)
def test_of_things_drawn_from_kinds_only_what_carries_over_is_tried(joints, sets):
    (candidate,) = candidates(TASKS, joints=joints, shear=True, drawn=True)
    assert candidate.sets == sets
    assert candidate.projection == "lda"
    assert np.min([grid.shrinkages for grid in candidate.grids]) == 0.3
    assert {grid.most_directions for grid in candidate.grids} == {10}
    assert np.max([grid.components for grid in candidate.grids]) == 10


def test_the_fewest_weights_are_cheapest_whatever_the_shrinkage_and_k():
    choices = [
        Choice("IV", 3, 1, "lda", 0.1, ("a", "b")),
        Choice("IV", 3, 5, "lda", 1.0, ("a", "b")),
        Choice("IV", 3, 1, "lda", 0.1, ("a",)),
        Choice("I", 2, 1, "pca", 0.1, ("a",)),
        Choice("IV", 20, 1, "pca", 0.1, ("a",)),
    ]
    assert costs(choices, {"a": 10, "b": 11}).tolist() == [1, 1, 0, 2, 2]


def test_of_equally_many_weights_those_listed_first_are_cheaper():
    choices = [Choice("IV", 1, 1, "lda", features=(name,)) for name in ("b", "a", "c")]
    assert costs(choices, {"a": 5, "b": 5, "c": 4}).tolist() == [1, 2, 0]
