"""Labels struck out at an error rate: the true one no oftener than asked, on unseen trials."""

from pathlib import Path

import numpy as np
import pytest

from edge.errors import InputError
from edge.model.prediction_set import PredictionSet
from edge.touch.features import feature_vector
from edge.touch.track import ContactTracker, first_contact
from train.conformal import Ranking, SequentialClassifier, deal, ratios
from train.importers import sdh2
from train.pipeline import Choice
from train.simulate.run import simulate
from train.simulate.scene import load

SCENES = Path(__file__).parents[2] / "train" / "scenes"
DECISION_POINTS = (0.3, 0.6, 0.9, 1.2)


def vectors(recordings, chain, decision_points=DECISION_POINTS):
    """(decision_points, n, p) and the labels of recordings with a contact."""
    rows, labels = [], []
    for recording in recordings:
        tracker = ContactTracker(recording.layout, chain=chain, horizon_s=decision_points[-1])
        found = first_contact(recording, tracker)
        if found is not None:
            rows.append([feature_vector(found[1], window) for window in decision_points])
            labels.append(recording.labels)
    y = {task: np.array([label[task] for label in labels]) for task in labels[0]}
    return np.array(rows).transpose(1, 0, 2), y


@pytest.fixture(scope="module")
def simulated():
    scene = load(SCENES / "cody18.toml", seed=77, count=8)
    made = dict(simulate(scene))
    names = sorted(made)
    return vectors([made[name] for name in names], scene.arm)


@pytest.fixture(scope="module")
def grasps(real):
    every = sdh2.trials(real / "sdh2_grasps_856.npz")
    return vectors([recording for i, (_, recording) in enumerate(every) if i % 2 == 0], None)


def parted(X, y, test):
    """Trials to train with, and the others."""
    return (
        X[:, ~test],
        {t: v[~test] for t, v in y.items()},
        X[:, test],
        {t: v[test] for t, v in y.items()},
    )


def watched(model, task, X, error, novelty_rate=0.05):
    """`PredictionSet` of each trial after all decision points it needs."""
    calibration = model.calibrations_[task]
    pvalues = [calibration.pvalues(decision_point, x) for decision_point, x in enumerate(X)]
    out = []
    for i in range(X.shape[1]):
        candidates = PredictionSet(calibration.classes, error, novelty_rate)
        for decision_point in range(len(X)):
            candidates.update(pvalues[decision_point][i])
        out.append(candidates)
    return out


def allowed(error, calibrated, tested):
    """The rate asked for and 1.96 standard deviations of both samples it is seen through."""
    return error + 1.96 * np.sqrt(error * (1 - error) * (1 / calibrated + 1 / tested))


def struck_out(model, task, X, labels, error):
    """Share of trials whose own label does not survive; labels never met count."""
    classes = model.decision_points_[-1].classes_[task].tolist()
    seen = watched(model, task, X, error)
    pairs = zip(seen, labels, strict=True)
    return np.mean([label not in [classes[i] for i in c.left] for c, label in pairs])


@pytest.mark.parametrize("task", ["category", "mobility", "object"])
def test_on_unseen_simulated_trials_the_true_label_survives_as_often_as_asked(simulated, task):
    X, y = simulated
    test = np.random.default_rng(1).permutation(X.shape[1]) % 2 == 0
    train_X, train_y, test_X, test_y = parted(X, y, test)
    model = SequentialClassifier({task: Choice("IV", 10, 2)}, DECISION_POINTS).fit(train_X, train_y)
    for error in (0.05, 0.1, 0.2, 0.3):
        rate = struck_out(model, task, test_X, test_y[task], error)
        assert rate <= allowed(error, (~test).sum(), test.sum())
    # A rate that is never used up would be no use either.
    assert struck_out(model, task, test_X, test_y[task], 0.3) > 0.05


def test_on_unseen_real_grasps_the_true_label_survives_as_often_as_asked(grasps):
    X, y = grasps
    test = np.random.default_rng(2).permutation(X.shape[1]) % 2 == 0
    train_X, train_y, test_X, test_y = parted(X, y, test)
    model = SequentialClassifier({"object": Choice("IV", 15, 1)}, DECISION_POINTS).fit(
        train_X, train_y
    )
    for error in (0.05, 0.1, 0.2, 0.3):
        rate = struck_out(model, "object", test_X, test_y["object"], error)
        assert rate <= allowed(error, (~test).sum(), test.sum())
    assert struck_out(model, "object", test_X, test_y["object"], 0.3) > 0.1


def far_off(model, X, novelty_rate):
    return np.mean([c.unknown for c in watched(model, "object", X, 1e-9, novelty_rate)])


def test_whole_objects_left_out_are_called_unknown_oftener_than_known_ones(simulated):
    """At the stated rate of false alarms; some simulated objects look like others."""
    X, y = simulated
    names = sorted(set(y["object"]))
    test = np.random.default_rng(3).permutation(X.shape[1]) % 2 == 0
    known, unknown = [], []
    for out in (names[0::3], names[1::3], names[2::3]):
        left_out = np.isin(y["object"], out)
        train = ~test & ~left_out
        model = SequentialClassifier({"object": Choice("IV", 10, 2)}, DECISION_POINTS).fit(
            X[:, train], {"object": y["object"][train]}
        )
        known.append(far_off(model, X[:, test & ~left_out], 0.1))
        unknown.append(far_off(model, X[:, left_out], 0.1))
        assert known[-1] <= allowed(0.1, train.sum(), (test & ~left_out).sum())
    assert np.mean(unknown) > 1.5 * np.mean(known)


def test_a_mean_of_two_folds_that_disagree_still_keeps_its_promise():
    """Labels drawn by chance: nothing can be told, and the true one is still not lost."""
    rng = np.random.default_rng(4)
    X, y = rng.normal(size=(3, 600, 12)), rng.choice(["a", "b", "c"], 600)
    test = np.arange(600) >= 200
    model = SequentialClassifier({"t": Choice("none", 5, 1)}, (1, 2, 3), ("max_force",), folds=2)
    model.fit(X[:, ~test], {"t": y[~test]})
    for error in (0.1, 0.2, 0.4):
        assert struck_out(model, "t", X[:, test], y[test], error) <= allowed(error, 200, 400)


def test_p_values_of_the_folds_are_uniform_for_the_true_label():
    """Split conformal prediction is exact: rank of one among exchangeable ones."""
    rng = np.random.default_rng(5)
    seen = []
    for _ in range(60):
        X, y = rng.normal(size=(2, 60, 8)), rng.choice(["a", "b"], 60)
        model = SequentialClassifier({"t": Choice("none", 3, 1)}, (1, 2), ("max_force",), folds=2)
        model.fit(X[:, :40], {"t": y[:40]})
        p = np.minimum.reduce([model.calibrations_["t"].pvalues(i, X[i, 40:]) for i in range(2)])
        own = np.searchsorted(["a", "b"], y[40:])
        seen.append(p[np.arange(20), :, own])
    p = np.concatenate(seen)
    for level in (0.1, 0.25, 0.5, 0.75):
        share = (p <= level).mean(axis=0)
        # 1200 trials in groups of 20 that share a training set: about 120 independent ones.
        assert (share <= level + 3 * np.sqrt(level * (1 - level) / 120)).all()


def test_the_ratio_is_to_the_nearest_other_label():
    nearest = np.array([[1.0, 4.0, 2.0], [0.0, 0.0, 3.0], [2.0, np.inf, 0.0], [5.0, 5.0, 9.0]])
    assert ratios(nearest).tolist() == [
        [0.5, 4.0, 2.0],
        [0.0, 0.0, np.inf],
        [np.inf, np.inf, 0.0],
        [1.0, 1.0, 1.8],
    ]
    assert ratios(nearest[:, :1]).tolist() == [[0.0]] * 4


def test_a_ranking_rises_and_tells_apart_what_lies_beyond_all_it_knows():
    ranking = Ranking.of(np.array([1.0, 2.0, 3.0, np.inf]))
    ranks = ranking(np.array([0.0, 0.5, 1.5, 2.5, 3.5, 1e6, 1e9, np.inf]))
    assert (np.diff(ranks) > 0).all()
    assert ranks[0] == 0.0
    assert ranks[-1] == 65.0


def test_folds_are_dealt_by_chance_alone_and_evenly():
    folds = deal(143, 5, 0)
    assert sorted(np.bincount(folds).tolist()) == [28, 28, 29, 29, 29]
    assert (folds == deal(143, 5, 0)).all()
    assert (folds != deal(143, 5, 1)).any()


def test_too_few_trials_to_calibrate_are_one_sentence():
    X = np.zeros((2, 19, 120))
    with pytest.raises(InputError, match="needs at least 20 trials, not 19"):
        SequentialClassifier({"t": Choice("none", 2, 1)}, (0.6, 1.2)).fit(
            X, {"t": np.array(["a"] * 19)}
        )
