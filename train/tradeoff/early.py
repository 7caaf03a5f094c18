"""Deciding as soon as it is sure, beside waiting for a fixed window, on trials held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from edge.candidates import ALARMS, Candidates
from train.conformal import SequentialClassifier
from train.pipeline import Choice
from train.simulate.scene import Scene

ERRORS = (0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)
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
class Beside:
    """Early stopping and fixed windows on the same trials with the same neighbours.

    Attributes:
        looks_s: windows.
        fixed: (looks,) share wrong at each window.
        early: an entry an asked error.
        trials: held out in turn.
    """

    looks_s: tuple[float, ...]
    fixed: NDArray[np.float64]
    early: list[Early]
    trials: int


def beside(
    X: NDArray[np.float64],
    labels: NDArray[np.str_],
    choice: Choice,
    looks_s: Sequence[float],
    features: Sequence[str],
) -> Beside:
    """Five folds are held out in turn; the others train and calibrate.

    Args:
        X: (looks, n, p).
        labels: (n,).
        choice: of the task.
        looks_s: windows in seconds.
        features: names of the types.
    """
    looks, n = X.shape[:2]
    fold_of = np.random.default_rng(1).permutation(n) % FOLDS
    right = np.zeros((looks, n), dtype=bool)
    outcomes: dict[float, list[tuple[bool, bool, bool, bool, bool, float]]] = {
        error: [] for error in ERRORS
    }
    with threadpool_limits(1):
        for fold in range(FOLDS):
            train, test = fold_of != fold, np.flatnonzero(fold_of == fold)
            model = SequentialClassifier({"task": choice}, looks_s, features).fit(
                X[:, train], {"task": labels[train]}
            )
            calibration = model.calibrations_["task"]
            classes = model.looks_[-1].classes_["task"]
            said = np.array([m.predict(X[i, test])["task"] for i, m in enumerate(model.looks_)])
            right[:, test] = said == labels[test]
            pvalues = [calibration.pvalues(i, X[i, test]) for i in range(looks)]
            for place, trial in enumerate(test):
                seen = [p[place] for p in pvalues]
                favourite = int(np.searchsorted(classes, said[-1, place]))
                for error in ERRORS:
                    outcomes[error].append(
                        _decide(seen, error, classes, labels[trial], favourite, looks_s)
                    )
    early = []
    for error, rows in outcomes.items():
        table = np.array(rows, dtype=np.float64).mean(axis=0)
        early.append(Early(error, *table.tolist()))
    return Beside(tuple(looks_s), 1.0 - right.mean(axis=1), early, n)


def _decide(
    pvalues: list[NDArray[np.float64]],
    error: float,
    classes: NDArray[np.str_],
    truth: str,
    favourite: int,
    looks_s: Sequence[float],
) -> tuple[bool, bool, bool, bool, bool, float]:
    """As the board's watcher does; (struck, wrong, sure and wrong, unsure, unknown, seconds)."""
    candidates = Candidates(len(classes), error, ALARMS)
    answer, seconds, settled = "", looks_s[-1], False
    for look, values in enumerate(pvalues):
        candidates.look(values)
        if candidates.settled and not settled:
            settled, seconds = True, looks_s[look]
            answer = "" if candidates.unknown else str(classes[candidates.left[0]])
    unknown = settled and not answer
    if not settled:
        answer = str(classes[candidates.best(favourite)])
    survivors = {str(classes[i]) for i in candidates.left}
    wrong = answer != truth
    return truth not in survivors, wrong, settled and wrong, not settled, unknown, seconds


def fixed_time(found: Beside, wrong: float) -> float | None:
    """The shortest fixed window, interpolated, with at most so large a share wrong; or None."""
    least = np.minimum.accumulate(found.fixed)
    if wrong < least[-1]:
        return None
    after = int(np.argmax(least <= wrong))
    if after == 0:
        return found.looks_s[0]
    high, low = least[after - 1], least[after]
    share = (high - wrong) / (high - low)
    return float(
        found.looks_s[after - 1] + share * (found.looks_s[after] - found.looks_s[after - 1])
    )


def saved(found: Beside, early: Early) -> float | None:
    """Share of time saved against the shortest fixed window that is as accurate; or None."""
    fixed = fixed_time(found, early.wrong)
    return None if fixed is None else 1.0 - early.mean_s / fixed


def floors(scene: Scene) -> dict[str, float]:
    """{object: seconds} before which an object that can move does not: mu_s m g / (k v).

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
            mass, friction = (_middle(thing.values[k]) for k in ("mass_kg", "friction_static"))
            found[thing.name] = friction * mass * G / (stiffness * speed)
    return found


def _middle(value: object) -> float:
    return float(np.mean(np.asarray(value, dtype=np.float64)))
