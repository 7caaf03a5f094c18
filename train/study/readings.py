"""Where the paper can be read in two ways and the reading changes numbers: each by name, with what
in the paper speaks for it and against it."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from edge.touch.features import FEATURES
from train.report.tables import Section, Table
from train.study.paper import Numbers, difference


@dataclass(frozen=True)
class PaperReading:
    """One way to read the paper.

    Attributes:
        name: what it says.
        table: of the paper, whose numbers it changes.
        instead_of: how we read it elsewhere.
        speaks_for, speaks_against: the paper's own words, and what follows from its numbers.
    """

    name: str
    table: str
    instead_of: str
    speaks_for: str
    speaks_against: str

    @property
    def key(self) -> str:
        """Stands for the table where `Context.ours` holds this reading's numbers."""
        return f"{self.table}: {self.name}"


EACH_TRIAL = PaperReading(
    "statistics of each trial",
    "II",
    "statistics of a feature over all trials",
    'Section IV-D writes "S_f = (f - mean(f)) / max(f)" of a feature f that section III-B calls a '
    '"time series" of a trial; and over all trials Methods I and II, and III and none, would be '
    "one classifier after PCA's centring, while Table II gives them up to 9.3 points apart.",
    'Methods I to IV "scale all three features within a uniform range", and it is "our original '
    'data" that is scaled, which speaks for one scale for all trials; and scaled by its own '
    "maximum a trial loses how hard it pressed.",
)
BY_MEAN = PaperReading(
    "coarse taxels by the mean",
    "I",
    "coarse taxels by the sum of their parts",
    'Section III-B represents a frame "as a gray-scale image", and an image is made smaller by '
    "averaging.",
    "a larger taxel bears the sum of what presses on its parts; the paper does not say how its "
    "coarse skins were made.",
)
READINGS = (EACH_TRIAL, BY_MEAN)


def scaled_by_trial(X: NDArray[np.float64], method: str) -> NDArray[np.float64]:
    """Eqs. 1 to 4 with mean, maximum and deviation of each feature of each trial.

    Args:
        X: (n, p) feature vectors of the paper's features.
        method: none or I to IV; V is one number a feature and is as it was.
    """
    f = X.reshape(len(X), len(FEATURES), -1)
    mean, most = f.mean(axis=2, keepdims=True), np.abs(f).max(axis=2, keepdims=True)
    deviation = f.std(axis=2, keepdims=True)
    one = {
        "I": (mean, most),
        "II": (0.0 * mean, most),
        "III": (mean, np.ones_like(mean)),
        "IV": (mean, deviation),
    }.get(method)
    if one is None:
        return X
    shift, scale = one
    return np.asarray(((f - shift) / np.where(scale > 0.0, scale, 1.0)).reshape(X.shape))


def averaged(X: NDArray[np.float64], parts: float) -> NDArray[np.float64]:
    """Feature vectors (n, p) of a skin that reads the mean of its `parts` where X has the sum;
    thresholds are as many times lower, so that the contacts are the same."""
    out = X.copy()
    columns = X.shape[1] // len(FEATURES)
    start = FEATURES.index("max_force") * columns
    out[:, start : start + columns] /= parts
    return out


def compare(ours: Numbers, judge: Numbers, tested: int) -> Section:
    """How each combination of readings fits the paper's numbers.

    Args:
        ours: percent, with the readings' own under their `key`.
        judge: the paper's percent.
        tested: trials behind each of ours.
    """
    table = Table(
        "paper_readings",
        "How each combination of readings fits",
        ("statistics", "coarse taxels", "within interval", "mean distance", "lowest rank"),
    )
    for taken in product((False, True), repeat=len(READINGS)):
        chosen = {r.table: r.key for r, yes in zip(READINGS, taken, strict=True) if yes}
        pairs: dict[tuple[str, str], list[tuple[float, float]]] = {}
        within = 0
        for (number, setting, task), percent in judge.items():
            found = ours.get((chosen.get(number, number), setting, task))
            found = ours.get((number, setting, task)) if found is None else found
            if found is None:
                continue
            low, high = difference(percent, found, tested)
            within += low <= 0.0 <= high
            pairs.setdefault((number, task), []).append((percent, found))
        every = [pair for group in pairs.values() for pair in group]
        ranks = [
            float(spearmanr(*np.array(group).T).statistic)
            for group in pairs.values()
            if np.ptp(np.array(group), axis=0).min() > 0.0
        ]
        names = [r.name if yes else r.instead_of for r, yes in zip(READINGS, taken, strict=True)]
        table.rows.append(
            (
                *names,
                f"{within} of {len(every)}",
                round(float(np.mean([abs(a - b) for a, b in every])), 2) if every else 0.0,
                round(min(ranks), 2) if ranks else "none",
            )
        )
    return Section(
        "Two readings of the paper",
        [
            "Everywhere else we take the first reading of each. That a combination fits better was "
            "found after the fact, on the numbers that it is judged by: it explains, and predicts "
            "nothing.",
            *(
                f"{r.name[0].upper()}{r.name[1:]} (Table {r.table}), instead of {r.instead_of}. "
                f"For it: {r.speaks_for} Against it: {r.speaks_against}"
                for r in READINGS
            ),
        ],
        [table],
        [],
    )
