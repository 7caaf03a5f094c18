"""The choice of settings and of the window."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

import train
from edge.decide.statistics import wilson
from edge.record.saving import save
from train.choose.choose import decided_together
from train.choose.evaluate import AnswerTable, NestedAccuracy
from train.choose.protocols import Protocol, rule_among
from train.choose.rule import Rule
from train.choose.settings import Chosen
from train.data.groups import Groups
from train.data.parts import part
from train.data.vectors import Vectors
from train.model.pipeline import Choice, ContactClassifier, vote

TWO = ("max_force", "contact_area")


def two_tasks(choices):
    """The answers of two candidates to twelve trials, of which the first is right about
    `t` and `u` by single trials; and with groups left out, where the second has eight
    more right about `t`, and the first two about `u`."""
    folds = np.arange(12) % 3
    first = np.repeat([[True], [False]], 12, axis=1)
    t = np.stack([np.arange(12) < 0, np.arange(12) < 12])
    u = np.stack([np.arange(12) < 8, np.arange(12) < 6])
    trials = {task: np.stack([first] * 3) for task in "tu"}
    groups = {"t": np.stack([t] * 2), "u": np.stack([u] * 2)}
    by_task = dict.fromkeys("tu", choices)
    return (
        AnswerTable(folds, by_task, trials),
        AnswerTable(folds // 2, by_task, groups),
    )


def most_accurate(task, choices):
    """The rule without prices."""
    return Rule()


def test_tasks_with_groups_share_the_best_mean_of_both_protocols():
    """By trials the first candidate gains 12 of 12 in both tasks, with groups left out it
    loses 12 of one and gains 2 of the other."""
    choices = [Choice("IV", 1, k, "lda") for k in (1, 3)]
    trials, unseen = two_tasks(choices)
    objects = Groups("object", trials.folds.astype(str), frozenset("tu"), unseen.folds)
    by_trials = Protocol(trials, most_accurate, beside=unseen, sharing="tu")
    by_groups = Protocol(unseen, most_accurate, objects, trials, "tu")
    for protocol in (by_trials, by_groups):
        assert protocol.choice("t").k == protocol.choice("u").k == 1
        assert {choice.k for choice in protocol.by_fold("t")} == {1}
    assert by_groups.name == "object"
    assert by_groups.accuracy("t").accuracy == 0.0
    assert by_groups.accuracy("u").accuracy == 8 / 12
    alone = replace(by_groups, sharing="t")
    assert alone.answers("t").mean(axis=1).tolist() == [0.5, 0.5]


def test_among_few_trials_the_most_accurate_is_chosen_whatever_its_price():
    choices = [Choice("IV", count, 1, "pca", features=TWO) for count in (1, 9)]
    choices[0] = replace(choices[0], features=TWO[:1])
    right = np.ones((2, 40), dtype=bool)
    right[0, :2] = right[1, 2] = False
    widths = dict.fromkeys(TWO, 3)
    assert rule_among(choices, widths).choose(right) == 0
    assert rule_among(choices, widths, is_few=True).choose(right) == 1


@pytest.fixture(scope="module")
def agreeing():
    """Trials of a category that is the pair of two other tasks' labels, the settings of
    each task, and folds."""
    rng = np.random.default_rng(1)
    places = rng.integers(0, 2, (2, 60))
    mobility = np.array(["f", "m"])[places[0]]
    softness = np.array(["r", "s"])[places[1]]
    category = np.char.add(softness, mobility)
    y = {"mobility": mobility, "softness": softness, "category": category}
    X = rng.normal(size=(60, 6))
    X[:, 0] += mobility == "m"
    X[:, 3] += softness == "s"
    choices = {task: Choice("IV", 2, 3, "lda") for task in y}
    return Vectors(X, y, TWO, (3, 3)), choices, np.arange(60) % 5


@pytest.fixture(scope="module")
def hits(agreeing):
    """{task: whether models without a trial's fold name its label}, and the same where it
    is decided alone."""
    vectors, choices, folds = agreeing
    right = defaultdict(lambda: np.zeros(60, dtype=bool))
    for fold in range(5):
        test = folds == fold
        X = vectors.X[test]
        model = ContactClassifier.of(choices, vectors.part(~test))
        for task, decision in model.decide(X).items():
            fitted = model.tasks_[task]
            alone = vote(fitted.labels[fitted.nearest(fitted.squares(X))])
            truth = vectors.y[task][test]
            right[task][test] = fitted.classes[decision.labels] == truth
            right[f"{task} alone"][test] = fitted.classes[alone] == truth
    return right


NONE_RIGHT = NestedAccuracy(0, 60, hits=np.zeros(60, dtype=bool))


def test_tasks_that_agree_are_scored_as_they_are_decided_together(agreeing, hits):
    vectors, choices, folds = agreeing
    chosen = {
        task: Chosen(choice, NONE_RIGHT, NONE_RIGHT, "trial")
        for task, choice in choices.items()
    }
    plans = {"trial": (folds, [choices] * 5)}
    for task, settings in decided_together(chosen, vectors, plans).items():
        assert (settings.accuracy.hits == hits[task]).all()
        assert settings.accuracy.right == hits[task].sum()
        assert settings.by_trial.right == hits[task].sum()
        assert settings.by_fold == (choices,) * 5


def test_a_task_with_groups_is_scored_by_single_trials_too(agreeing, hits):
    vectors, choices, folds = agreeing
    mobility = replace(vectors, y={"mobility": vectors.y["mobility"]})
    chosen = {"mobility": Chosen(choices["mobility"], NONE_RIGHT, NONE_RIGHT, "object")}
    plans = {left_out: (folds, [choices] * 5) for left_out in ("trial", "object")}
    settings = decided_together(chosen, mobility, plans)["mobility"]
    assert settings.by_trial.right == hits["mobility alone"].sum()


def test_a_category_is_right_where_both_of_its_factors_are(hits):
    of_factors = hits["mobility"] & hits["softness"]
    assert (hits["category"] == of_factors).all()
    assert (hits["category"] != hits["category alone"]).any()


FEW = {
    "features": ["max_force"],
    "projection": "pca",
    "scaling": "none",
    "k": 1,
    "jobs": 1,
}


def touches(make_touch, folder, seconds, late_s):
    """Touches of two kinds that differ from `late_s` after onset on."""
    for seed in range(20):
        labels = {"kind": "ab"[seed % 2]}
        touch = make_touch(seed=seed, seconds=seconds, arm=False, labels=labels)
        touch = part(touch, slice(None, None, 4))
        frames = np.minimum(touch.frames, 700)
        frames[touch.t > 0.2 + late_s] //= 1 + seed % 2
        save(folder / f"{seed}.npz", replace(touch, frames=frames))
    return str(folder)


@pytest.fixture(scope="module")
def late(make_touch, tmp_path_factory):
    """A model of touches that differ from 1.8 s on."""
    return train.fit(
        touches(make_touch, tmp_path_factory.mktemp("late"), 6.0, 1.8), **FEW
    )


def test_no_second_is_waited_that_tells_nothing(late):
    assert late.window_s == 2.4
    (note,) = [note for note in late.notes if "the window is" in note]
    assert "the window is 2.4 s" in note
    assert "100% at 2.4 s, 100% at 4.8 s" in note


def test_accuracies_are_those_at_the_chosen_window(late):
    settings = late.chosen["kind"]
    for result in (settings.accuracy, settings.by_trial, *settings.candidates):
        assert result.accuracy == 1.0
        assert result.interval == wilson(8, 8)


def test_a_longer_window_has_no_more_decision_points(late):
    points = late.sequential.decision_points_s
    assert points[-1] == 2.4
    assert len(points) <= 12


def test_touches_that_differ_early_are_told_in_the_usual_window(make_touch, tmp_path):
    early = train.fit(touches(make_touch, tmp_path, 6.0, 0.4), **FEW)
    assert early.window_s == 1.2


@pytest.mark.parametrize(
    "words", [{"window_s": 1.2}, {"decision_points_s": (0.6, 1.2)}]
)
def test_a_window_that_is_given_is_kept(words, make_touch, tmp_path):
    fitted = train.fit(touches(make_touch, tmp_path, 4.0, 1.8), **FEW, **words)
    assert fitted.window_s == 1.2
    assert not any("the window is" in note for note in fitted.notes)
