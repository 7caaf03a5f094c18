"""Simulated trials beside the owner's."""

from dataclasses import replace

import numpy as np
import pytest

import train
from edge.errors import InputError
from edge.saving import save
from edge.statistics import wilson
from train.model.pipeline import Choice, ContactClassifier
from train.model.projection import Projection

GIVEN = {
    "features": ["max_force", "contact_area"],
    "projection": "lda",
    "quick": True,
    "jobs": 1,
}


def saved(folder, make_touch, count, *, simulated, swap=False, first=0, **more):
    """Hard and soft touches, and the folder; `swap` gives each the other's category."""
    for seed in range(first, first + count):
        kind = ("hard", "soft")[seed % 2]
        touch = make_touch(kind=kind, seed=seed)
        labels = {"category": ("rigid-fixed", "soft-fixed")[(seed + swap) % 2], **more}
        if simulated:
            labels |= {
                "softness": labels["category"].split("-")[0],
                "object": f"{kind} {seed % 6}",
            }
        meta = {
            **touch.meta,
            "labels": labels,
            **({"simulation": {}} if simulated else {}),
        }
        save(folder / f"{seed:02}.npz", replace(touch, meta=meta))
    return str(folder)


@pytest.fixture(scope="module")
def five(make_touch, tmp_path_factory):
    """A fit to five trials with a category alone, beside simulated ones."""
    folder = tmp_path_factory.mktemp("five")
    simulated = saved(folder / "simulated", make_touch, 24, simulated=True)
    own_folder = saved(folder / "own", make_touch, 5, simulated=False, first=50)
    return train.fit([own_folder, simulated], **GIVEN)


def test_five_trials_with_a_category_alone_are_trained_with_all_the_simulated_ones(
    five,
):
    assert len(five.dataset.trials) == 29
    assert set(five.chosen) == {"category", "softness"}


@pytest.mark.parametrize("task", ["category", "softness"])
def test_five_trials_choose_no_weight_and_promise_little(five, task):
    chosen = five.chosen[task]
    assert chosen.choice.weights == (1, 1)
    assert chosen.accuracy.right == 5
    assert chosen.accuracy.total == 5
    assert chosen.accuracy.interval == chosen.by_trial.interval == wilson(2.0, 2.0)


def test_the_notes_say_how_much_the_simulated_trials_help(five):
    begun, few, category, *_ = five.notes
    assert "5 of your own trials beside 24 simulated ones" in begun
    assert "not fitted, as fewer than 3 of your own have it: object" in few
    weights = "both 100.0%, both, yours counted 5 times (half of the weight) 100.0%, "
    assert weights + "your" in category


def test_simulated_trials_that_mislead_are_left_out_and_it_is_said(
    make_touch, tmp_path
):
    simulated = saved(tmp_path / "simulated", make_touch, 24, simulated=True, swap=True)
    own_folder = saved(
        tmp_path / "own",
        make_touch,
        22,
        simulated=False,
        first=50,
        room="kitchen",
    )
    fitted = train.fit([own_folder, simulated], **GIVEN)
    assert fitted.chosen["category"].choice.weights == (0, 1)
    # No simulated trial has a room.
    assert fitted.chosen["room"].choice.weights == (0, 1)
    assert fitted.classifier.tasks_["category"].space.rows.shape[0] == 22
    assert any(
        "simulated trials no longer help category" in note for note in fitted.notes
    )
    assert fitted.sequential.stopping_["category"].trials == 22


def test_two_trials_choose_nothing(make_touch, tmp_path):
    simulated = saved(tmp_path / "simulated", make_touch, 8, simulated=True)
    own_folder = saved(tmp_path / "own", make_touch, 2, simulated=False, first=50)
    with pytest.raises(
        InputError, match="2 of the trials are no simulated ones; record at least"
    ):
        train.fit([own_folder, simulated], **GIVEN)


def test_a_weight_of_three_is_a_trial_that_stands_three_times():
    rng = np.random.default_rng(0)
    X = rng.normal(size=(12, 6))
    labels = np.array(["a", "b", "c"] * 4)
    is_own = np.arange(12) >= 8
    choice = Choice("IV", 2, 1, "lda", weights=(1, 3))
    fitted = ContactClassifier({"t": choice}, ("max_force", "contact_area")).fit(
        X,
        {"t": labels},
        is_own,
    )
    times = np.repeat(np.arange(12), np.where(is_own, 3, 1))
    oracle = Projection("IV", 2, ("max_force", "contact_area"), "lda").fit(
        X[times], labels[times]
    )
    space = fitted.tasks_["t"].space
    assert space.projection.weights_.tobytes() == oracle.weights_.tobytes()
    assert (space.rows == oracle.transform(X)).all()
