"""From recordings to a fitted model, from Python."""

import numpy as np

import train
from edge.record.saving import save
from train.choose.evaluate import VARIANCE
from train.choose.settings import Settings
from train.data.dataset import Measurement, load_trials
from train.data.folds import stratified_folds

PAPER = {"features": ["paper"], "projection": "pca", "scaling": "IV", "jobs": 1}
"""Few candidates."""


def test_each_task_has_its_own_choice_and_the_model_measures_what_they_take(recordings):
    fitted = train.fit(str(recordings), quick=True, jobs=1)
    assert set(fitted.chosen) == {"category", "object"}
    assert fitted.chosen["category"].accuracy.right == 16
    features = {
        name for settings in fitted.chosen.values() for name in settings.choice.features
    }
    assert set(fitted.dataset.names) == features
    assert fitted.X.shape == (16, sum(fitted.dataset.widths(fitted.samples)))
    assert len(fitted.measured.names) > len(fitted.dataset.names)


def test_a_data_set_can_be_given_and_single_trials_left_out(recordings):
    data = load_trials([recordings], Measurement(["max_force", "contact_area"]))
    fixed = PAPER | {"features": ["max_force", "contact_area"]}
    fitted = train.fit(data, **fixed, leave_out="trial", decision_points_s=())
    assert fitted.chosen["category"].held_out == "trial"
    assert not any("--leave-out trial" in note for note in fitted.notes)
    assert fitted.sequential is None


def test_whole_objects_are_left_out_where_every_class_has_three(make_touch, tmp_path):
    for kind in ("hard", "soft"):
        for seed in range(9):
            labels = {"category": kind, "object": f"{kind} {seed % 3}", "side": kind}
            save(
                tmp_path / f"{kind}{seed}.npz",
                make_touch(kind=kind, seed=seed, labels=labels),
            )
    fitted = train.fit(str(tmp_path), **PAPER)
    settings = fitted.chosen["category"]
    assert settings.held_out == "object"
    assert any("`--leave-out trial` chooses" in note for note in fitted.notes)
    # The 18 trials count as much as their six objects do.
    assert settings.accuracy.variance == 3.0
    assert settings.by_trial.variance == VARIANCE
    assert fitted.chosen["object"].held_out == "trial"
    # The folds have all labels of the task that has the most of them.
    folds = stratified_folds(fitted.dataset.labels("object"))
    assert (fitted.chosen["object"].folds == folds).all()


def test_touches_that_were_missed_are_wrong_and_none_found_in_none_is_right(
    recordings,
    make_touch,
    tmp_path,
):
    for name, label in (("missed", "rigid-fixed"), ("empty", "none")):
        labels = {"category": label, "object": "hard 0"}
        save(tmp_path / f"{name}.npz", make_touch(seconds=0.0, labels=labels))
    paths = [str(recordings), str(tmp_path)]
    fits = [train.fit(data, **PAPER) for data in (paths, paths[0])]
    after, before = (fitted.chosen["category"].accuracy for fitted in fits)
    assert after.right == before.right + 1
    assert after.total == before.total + 2


def test_settings_are_chosen_by_a_part_of_many_trials_and_fitted_on_all(
    recordings, monkeypatch
):
    monkeypatch.setattr("train.fitting.MOST_CHOSEN", 12)
    fitted = train.fit(str(recordings), **PAPER, decision_points_s=())
    assert len(fitted.measured.trials) == 12
    assert len(fitted.X) == len(fitted.dataset.trials) == 16
    assert fitted.chosen["category"].accuracy.total == 12


def test_trials_that_had_no_part_in_the_choice_get_folds_beside_those_that_had():
    chosen_by = np.array([0, 3, 4, 8, 9, 11])
    few = np.array([2, 1, 0, 0, 1, -1])
    settings = Settings({}, few, [{}] * 3, (), 1.2, [])
    folds = settings.with_others(chosen_by, {"object": np.array(["cup"] * 12)}).folds
    assert folds[chosen_by].tolist() == few.tolist()
    assert set(np.delete(folds, chosen_by).tolist()) == {0, 1, 2}
