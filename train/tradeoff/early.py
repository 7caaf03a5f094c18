"""Deciding as soon as it is sure, beside waiting for a fixed window, on trials held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.model.prediction_set import NOVELTY_RATE, PredictionSet
from train.conformal import FEWEST, SequentialClassifier
from train.conformal import FOLDS as CALIBRATION_FOLDS
from train.simulate.scene_model import Scene
from train.tradeoff.accuracy import evaluate_split

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
FOLDS = 5
G = 9.80665


@dataclass(frozen=True)
class Early:
    """Decisions at one asked error, over all trials held out.

    Attributes:
        asked: the error rate.
        struck: share of trials whose true label did not survive.
        wrong: share of trials whose decision was wrong, unsure and unknown ones among them.
        sure_wrong: share of trials decided for one label, and that wrongly.
        unsure, unknown: shares of trials.
        mean_s: mean time to decision.
    """

    asked: float
    struck: float
    wrong: float
    sure_wrong: float
    unsure: float
    unknown: float
    mean_s: float


@dataclass(frozen=True)
class StoppingComparison:
    """Early stopping and fixed windows on the same trials.

    Attributes:
        decision_points_s: windows.
        fixed: (decision_points,) share wrong at each window, with components and k chosen for that
            window.
        early: an entry an asked error.
        trials: held out in turn.
        hindsight_s: mean of the first window from which on each trial is told as right or wrong
            as at the full one: what no rule that stops on these answers could undercut.
    """

    decision_points_s: tuple[float, ...]
    fixed: NDArray[np.float64]
    early: list[Early]
    trials: int
    hindsight_s: float


def compare_stopping(
    X: NDArray[np.float64],
    labels: NDArray[np.str_],
    decision_points_s: Sequence[float],
    features: Sequence[str],
    scaling: str = "IV",
) -> StoppingComparison:
    """Five folds are held out in turn; the others choose, train and calibrate.

    Args:
        X: (decision_points, n, p).
        labels: (n,).
        decision_points_s: windows in seconds.
        features: names of the types.
        scaling: of the features.
    """
    decision_points, n = X.shape[:2]
    indices = {"task": np.unique(labels, return_inverse=True)[1]}
    fold_of = np.random.default_rng(1).permutation(n) % FOLDS
    right = np.zeros((decision_points, n), dtype=bool)
    outcomes: dict[float, list[tuple[bool, bool, bool, bool, bool, float]]] = {
        error: [] for error in ERRORS
    }
    with threadpool_limits(1):
        for fold in range(FOLDS):
            train, test = np.flatnonzero(fold_of != fold), np.flatnonzero(fold_of == fold)
            cells = [evaluate_split(x, indices, train, test, scaling, features)["task"] for x in X]
            right[:, test] = [cell.right for cell in cells]
            model = SequentialClassifier(
                {"task": cells[-1].choice}, decision_points_s, features
            ).fit(X[:, train], {"task": labels[train]})
            calibration = model.calibrations_["task"]
            last = model.decision_points_[-1]
            classes = last.classes_["task"]
            said = last.predict(X[-1, test])["task"]
            pvalues = [calibration.pvalues(i, X[i, test]) for i in range(decision_points)]
            for place, trial in enumerate(test):
                seen = [p[place] for p in pvalues]
                favourite = int(np.searchsorted(classes, said[place]))
                for error in ERRORS:
                    outcomes[error].append(
                        _decide(seen, error, classes, labels[trial], favourite, decision_points_s)
                    )
    early = []
    for error, rows in outcomes.items():
        table = np.array(rows, dtype=np.float64).mean(axis=0)
        early.append(Early(error, *table.tolist()))
    return StoppingComparison(
        tuple(decision_points_s),
        1.0 - right.mean(axis=1),
        early,
        n,
        hindsight(right, decision_points_s),
    )


def hindsight(right: NDArray[np.bool_], decision_points_s: Sequence[float]) -> float:
    """Mean seconds until `right` (decision_points, n) keeps its final value."""
    same = right == right[-1]
    stays = np.logical_and.accumulate(same[::-1])[::-1]
    return float(np.array(decision_points_s)[stays.argmax(axis=0)].mean())


@dataclass(frozen=True)
class Novelty:
    """Contacts with things that were trained, and with things that were not.

    Attributes:
        novelty_rate: how often a trained thing may be called unknown for lying far from all.
        known: trials of trained things, and how many of them were called unknown.
        strange: the same of things left out whole.
    """

    novelty_rate: float
    known: tuple[int, int]
    strange: tuple[int, int]


def novelty(
    X: NDArray[np.float64],
    labels: NDArray[np.str_],
    decision_points_s: Sequence[float],
    features: Sequence[str],
    scaling: str = "IV",
    error: float = 0.2,
    rates: Sequence[float] = (NOVELTY_RATE, 0.1, 0.2),
) -> list[Novelty]:
    """A third of the labels is left out whole, in turn; a fifth of the others' trials is held out.

    Args:
        X, labels, decision_points_s, features, scaling: as for `compare_stopping`.
        error: asked for.
        rates: of false alarms asked for.

    Returns:
        An entry a rate; none where too few trials are left to calibrate with.
    """
    names, places = np.unique(labels, return_inverse=True)
    indices = {"task": places}
    held = np.random.default_rng(2).permutation(len(labels)) % FOLDS == 0
    counts = {rate: np.zeros((2, 2), dtype=int) for rate in rates}
    with threadpool_limits(1):
        for third in range(3):
            strange = np.isin(labels, names[third::3])
            train = np.flatnonzero(~strange & ~held)
            if len(np.unique(labels[train])) < 2 or len(train) < FEWEST * CALIBRATION_FOLDS:
                continue
            cell = evaluate_split(X[-1], indices, train, train[:0], scaling, features)["task"]
            model = SequentialClassifier({"task": cell.choice}, decision_points_s, features).fit(
                X[:, train], {"task": labels[train]}
            )
            calibration = model.calibrations_["task"]
            for row, trials in enumerate((~strange & held, strange)):
                pvalues = [calibration.pvalues(i, x[trials]) for i, x in enumerate(X)]
                for rate in rates:
                    for place in range(int(trials.sum())):
                        candidates = PredictionSet(calibration.classes, error, rate)
                        for values in pvalues:
                            if not candidates.settled:
                                candidates.narrow(values[place])
                        counts[rate][row] += (1, candidates.unknown)
    return [
        Novelty(rate, (int(k[0]), int(k[1])), (int(s[0]), int(s[1])))
        for rate, (k, s) in counts.items()
        if k[0] and s[0]
    ]


def _decide(
    pvalues: list[NDArray[np.float64]],
    error: float,
    classes: NDArray[np.str_],
    truth: str,
    favourite: int,
    decision_points_s: Sequence[float],
) -> tuple[bool, bool, bool, bool, bool, float]:
    """As the board's watcher does; (struck, wrong, sure and wrong, unsure, unknown, seconds)."""
    candidates = PredictionSet(len(classes), error, NOVELTY_RATE)
    answer, seconds, settled = "", decision_points_s[-1], False
    for decision_point, values in enumerate(pvalues):
        candidates.narrow(values)
        if candidates.settled and not settled:
            settled, seconds = True, decision_points_s[decision_point]
            answer = "" if candidates.unknown else str(classes[candidates.remaining[0]])
    unknown = settled and not answer
    if not settled:
        answer = str(classes[candidates.best(favourite)])
    survivors = {str(classes[i]) for i in candidates.remaining}
    wrong = answer != truth
    return truth not in survivors, wrong, settled and wrong, not settled, unknown, seconds


def fixed_time(found: StoppingComparison, wrong: float) -> float | None:
    """The shortest fixed window, interpolated, with at most so large a share wrong; or None."""
    least = np.minimum.accumulate(found.fixed)
    if wrong < least[-1]:
        return None
    after = int(np.argmax(least <= wrong))
    if after == 0:
        return found.decision_points_s[0]
    high, low = least[after - 1], least[after]
    share = (high - wrong) / (high - low)
    return float(
        found.decision_points_s[after - 1]
        + share * (found.decision_points_s[after] - found.decision_points_s[after - 1])
    )


def saved(found: StoppingComparison, early: Early) -> float:
    """Share of time saved against the shortest fixed window that is as accurate.

    Where none is, the full window stands in: it takes longer and is less accurate, so that the
    share is a lower bound.
    """
    fixed = fixed_time(found, early.wrong)
    return 1.0 - early.mean_s / (found.decision_points_s[-1] if fixed is None else fixed)


def at_full_accuracy(found: StoppingComparison) -> tuple[float, Early] | None:
    """The most time saved, against the full window, by an asked error no less accurate than it."""
    able = [one for one in found.early if one.wrong <= found.fixed[-1]]
    if not able:
        return None
    quickest = min(able, key=lambda one: one.mean_s)
    return 1.0 - quickest.mean_s / found.decision_points_s[-1], quickest


def breakaway_times(scene: Scene) -> dict[str, float]:
    """{object: seconds} before which an object that can move does not: mu_s m g / (k v).

    What is narrow and high tips before it slides: where its base over twice the contact's height
    is less than mu_s, it takes mu_s's place. Values are the middles of the scene's.

    k is the arm's stiffness at the contact along its motion, v the speed of its equilibrium
    point there; the spring between them is all that pushes. What is soft besides only delays.
    """
    q = np.array(scene.start)

    def place(q: NDArray[np.float64]) -> NDArray[np.float64]:
        pose = scene.arm.pose(q)
        return np.asarray(pose[:3, :3] @ [0.0, 0.0, scene.place_m] + pose[:3, 3])

    step = 1e-6
    jacobian = np.stack(
        [(place(q + step * e) - place(q - step * e)) / (2 * step) for e in np.eye(len(q))], axis=1
    )
    velocity = jacobian @ np.array(scene.rate)
    speed = float(np.linalg.norm(velocity))
    pull = jacobian.T @ (velocity / speed)
    stiffness = 1.0 / float((pull**2 / np.array(scene.stiffness)).sum())
    found = {}
    for thing in scene.objects:
        if "movable" in thing.conditions and "mass_kg" in thing.values:
            values = {key: value.middle for key, value in thing.values.items()}
            share = values["friction_static"]
            if values.get("base_m", 0.0) > 0.0 and values.get("height_m", 0.0) > 0.0:
                share = min(share, values["base_m"] / (2.0 * values["height_m"]))  # it tips
            found[thing.name] = share * values["mass_kg"] * G / (stiffness * speed)
    return found
