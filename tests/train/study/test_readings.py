"""Two readings of the paper: what each changes, and how combinations of them are judged."""

from __future__ import annotations

import numpy as np

from train.study.paper import entries
from train.study.readings import BY_MEAN, EACH_TRIAL, averaged, compare, scaled_by_trial


def test_each_trials_own_statistics_scale_its_features():
    rng = np.random.default_rng(0)
    X = rng.uniform(0.5, 4.0, (5, 12))
    for i, method in enumerate(("I", "II", "III", "IV")):
        f = X[3, 4:8]
        want = (
            (f - f.mean()) / f.max(),
            f / f.max(),
            f - f.mean(),
            (f - f.mean()) / f.std(),
        )[i]
        np.testing.assert_allclose(scaled_by_trial(X, method)[3, 4:8], want, rtol=1e-15)
    assert scaled_by_trial(X, "none") is X


def test_a_feature_that_stays_zero_is_left_zero():
    for method in ("I", "II", "III", "IV"):
        assert (scaled_by_trial(np.zeros((2, 6)), method) == 0.0).all()


def test_by_trial_methods_that_are_one_classifier_over_all_trials_differ():
    X = np.random.default_rng(1).uniform(0.0, 1.0, (6, 9))

    def centred(method):
        scaled = scaled_by_trial(X, method)
        return scaled - scaled.mean(axis=0)

    assert not np.allclose(centred("I"), centred("II"))
    assert not np.allclose(centred("III"), X - X.mean(axis=0))


def test_a_coarse_taxel_by_the_mean_divides_forces_alone():
    X = np.arange(12.0).reshape(2, 6)
    out = averaged(X, 4.0)
    np.testing.assert_array_equal(out[:, :2], X[:, :2] / 4.0)
    np.testing.assert_array_equal(out[:, 2:], X[:, 2:])


def test_each_combination_is_judged_with_its_own_numbers():
    theirs = {(e.table, e.setting, e.task): e.percent for e in entries()}
    ours = dict.fromkeys(theirs, 1.0)
    for (table, setting, task), percent in theirs.items():
        for reading in (EACH_TRIAL, BY_MEAN):
            if table == reading.table:
                ours[reading.key, setting, task] = percent
    (table,) = compare(ours, theirs, 1120).tables
    within = {
        (row["statistics"], row["coarse taxels"]): int(row["within interval"].split()[0])
        for row in table.rows
    }
    in_table = {t: sum(key[0] == t for key in theirs) for t in ("I", "II", "III")}
    assert within[EACH_TRIAL.instead_of, BY_MEAN.instead_of] == 0
    assert within[EACH_TRIAL.name, BY_MEAN.instead_of] == in_table["II"]
    assert within[EACH_TRIAL.instead_of, BY_MEAN.name] == in_table["I"]
    assert within[EACH_TRIAL.name, BY_MEAN.name] == in_table["I"] + in_table["II"]
