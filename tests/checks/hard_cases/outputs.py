"""What follows from the outputs of a model with decision points and a joint task.

The oracle knows the fitted numbers of a model and the rules that the documentation
states. It shares no code with the graph, with `train` or with `edge`: it computes in
whole numbers and fractions, and rounds where IEEE 754 says that an operation rounds.
"""

from fractions import Fraction
from functools import cache

import mpmath
import numpy as np
from hypothesis import strategies as st
from mpmath import mpf

from tests.checks.hard_cases import exact
from tests.checks.hard_cases.cases import SEEDS, Case, Ladder, decades, powers_of_ten
from tests.checks.hard_cases.models import exported, features
from tests.checks.hard_cases.neighbours import near_duplicates, offset_data
from train.data.folds import stratified_folds
from train.model.pipeline import Choice
from train.model.stopping import SequentialClassifier

POINTS_S = (0.4, 0.8, 1.2)
LDA = {"projection": "lda", "shrinkage": 0.1}
CHOICES = {
    "category": Choice("III", 4, 5, **LDA),
    "mobility": Choice("none", 6, 1),
    "softness": Choice("IV", 12, 2),
    "object": Choice("none", 20, 4),
    "surface": Choice("III", 5, 7),
}
"""Of every number of neighbours that the graph treats in its own way: one, two,
more."""
KINDS = ("contacts", "near-duplicates", "duplicates", "offset", "tiny")


def labels_of(n):
    """A joint task and its factors, objects, and surfaces that every third trial
    lacks."""
    rng = np.random.default_rng(2012)
    objects = rng.permutation(np.arange(n) % 12)
    mobility = np.array(["fixed", "movable"])[objects % 2]
    softness = np.array(["rigid", "soft"])[objects // 2 % 2]
    surface = np.array(["bark", "cloth", "foam"])[objects % 3]
    surface[::3] = ""
    return {
        "category": np.char.add(np.char.add(softness, "-"), mobility),
        "mobility": mobility,
        "softness": softness,
        "object": np.char.add("o", objects.astype(str)),
        "surface": surface,
    }


def trials(n, kind):
    """(n, 120) training vectors of a kind."""
    if kind == "near-duplicates":
        return near_duplicates(n, 1e-6, 0)[0]
    if kind == "duplicates":
        return np.repeat(features(n // 4), 4, axis=0)
    if kind == "offset":
        return offset_data(1e6, 0.01, 0, n)[0]
    return features(n) * (1e-24 if kind == "tiny" else 1.0)


class Whole:
    """A fitted model with decision points, its exported graph, and the oracle of the
    two.

    Args:
        n: training trials, a multiple of eight.
        kind: one of `KINDS`.
    """

    def __init__(self, n, kind):
        X = trials(n, kind)
        self.y = labels_of(n)
        # Early windows: of the same trials, with less of what tells them apart.
        self.X = np.stack([X[::-1], 0.5 * (X + X[::-1]), X])
        classifier = SequentialClassifier(CHOICES, POINTS_S)
        folds = stratified_folds(self.y["object"])
        self.fitted = classifier.fit(self.X, self.y, folds, [CHOICES] * 10)
        _, self.model = exported(self.fitted)

    def queries(self, seed, factor, count=10):
        """Vectors between training rows, on them, and `factor` times as far away."""
        rng = np.random.default_rng(seed)
        X = self.X[-1]
        first, second = X[rng.integers(0, len(X), (2, count))]
        middle = X.mean(axis=0)
        mixed = middle + factor * (0.5 * (first + second) - middle)
        return np.concatenate([first[:2], mixed])

    def outputs(self, vectors, point):
        """What the graph is to answer to vectors (n, 120) at a decision point."""
        fitted = self.fitted.decision_points_[point]
        answers = exact.outputs(fitted, self.X[point], self.y, vectors)
        return answers | exact.doubt(self.fitted.space_, point, vectors)


@cache
def whole(n, kind):
    return Whole(n, kind)


def agreed(task, factors, distances):
    """{task: label and distance of each label} of a joint task and its factors, for a
    vector.

    The three distances of an answer are added one by one, and each sum is rounded once.
    """
    totals = [Fraction(value) for value in distances[task].tolist()]
    for factor, indices in factors.items():
        further = [Fraction(distances[factor][i]) for i in indices]
        totals = [Fraction(float(a + b)) for a, b in zip(totals, further, strict=True)]
    best = totals.index(min(totals))
    answers = {task: (best, [float(total) for total in totals])}
    for factor, indices in factors.items():
        nearest = [
            float(min(t for t, of in zip(totals, indices, strict=True) if of == label))
            for label in sorted(set(indices))
        ]
        answers[factor] = indices[best], nearest
    return answers


def agreement_error(kind, point, factor, seed):
    """Decisions whose label, distances or tie is not the oracle's."""
    subject = whole(160, kind)
    vectors = subject.queries(seed, factor)
    outputs = subject.outputs(vectors, point)
    classes = {task: subject.model.info.tasks[task].labels for task in CHOICES}
    wrong = 0
    for row, vector in enumerate(vectors):
        distances = {t: outputs[f"{t}_label_distances"][row] for t in CHOICES}
        answers = {t: (int(outputs[f"{t}_label"][row]), distances[t]) for t in CHOICES}
        for task, factors in subject.fitted.joint_tasks_.items():
            answers |= agreed(task, factors, distances)
        for task, decision in subject.model.decide(vector, point).items():
            label, nearest = answers[task]
            scores = outputs[f"{task}_scores"][row].tolist()
            tie = sorted(scores)[-1] == sorted(scores)[-2]
            same = (
                decision.label == classes[task][label]
                and np.array_equal(decision.label_distances, nearest)
                and decision.tie == tie
            )
            wrong += not same
    return float(wrong)


def confidence_error(kind, point, factor, seed):
    """Largest error of a confidence, over what its log odds resolve."""
    subject = whole(160, kind)
    info = subject.model.info
    worst = 0.0
    for vector in subject.queries(seed, factor, 4):
        for task, decision in subject.model.decide(vector, point).items():
            label = info.tasks[task].labels.index(decision.label)
            rule = info.stopping[task]
            with mpmath.workdps(50):
                far = [mpf(float(d)) for d in decision.label_distances]
                rival = min(d for i, d in enumerate(far) if i != label)
                typical = mpf(info.outlier_score.typical[point])
                outlier_score = mpf(decision.outlier_score) / typical
                excess = mpmath.log(outlier_score) if outlier_score > 1 else mpf(0)
                terms = [
                    mpf(rule.slopes[point]) * (rival - far[label]),
                    mpf(rule.intercepts[point]),
                    -mpf(rule.doubts[point]) * excess,
                ]
                log_odds = sum(terms)
                true = 1 / (1 + mpmath.exp(-log_odds))
                if rule.known_distance is not None:
                    true *= rule.known_distance.known(point, decision.known_distance)
                # An ulp of each term moves the probability by p (1 - p) of it.
                resolved = 1 + true * (1 - true) * sum(map(abs, terms))
                error = abs(mpf(decision.confidence) - true) / resolved
            worst = max(worst, float(error))
    return worst


HAZARDS = [
    {"kind": kind, "point": i % 3, "factor": (1.0, 1e12)[i % 2], "seed": 0}
    for i, kind in enumerate(KINDS)
]
AROUND = {
    "kind": st.sampled_from(KINDS),
    "point": st.integers(0, len(POINTS_S) - 1),
    "factor": powers_of_ten(-1.0, 15.0),
    "seed": SEEDS,
}
FARTHER = Ladder(
    "distance over that of training trials",
    decades(0, 160, 0.05),
    "factor",
    "up to 0.5",
    {"point": 1},
)

CASES = [
    Case(
        "outputs: a joint task and its factors agree; ties of votes",
        "fractions, each sum rounded once",
        "decisions with another label, distance or tie",
        agreement_error,
        HAZARDS,
        AROUND,
        FARTHER,
        examples=6,
    ),
    Case(
        "outputs: confidence, near certainty and far from all trials",
        "mpmath, 50 digits",
        "error over what the log odds resolve",
        confidence_error,
        HAZARDS,
        AROUND,
        FARTHER,
        examples=6,
        bound=1e-15,
    ),
]
