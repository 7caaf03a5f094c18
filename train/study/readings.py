"""Two sentences of the paper that can be read in two ways, with what each way changes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from edge.touch.features import FEATURES
from train.report.section import Numbers, Section, Table
from train.study.context import Context
from train.study.paper import difference, entries, mean_of, rank_correlation


@dataclass(frozen=True)
class PaperReading:
    """One way to read the paper.

    Attributes:
        name: the reading.
        table: table of the paper whose numbers it changes.
        instead_of: the reading that the other sections take.
        speaks_for, speaks_against: the paper's own words, and what follows from its numbers.
    """

    name: str
    table: str
    instead_of: str
    speaks_for: str
    speaks_against: str

    @property
    def key(self) -> str:
        """The name that stands for the table in this reading's `Numbers`."""
        return f"{self.table}: {self.name}"

    @property
    def text(self) -> str:
        """A paragraph on what speaks for and against it."""
        name = self.name[0].upper() + self.name[1:]
        return (
            f"{name} (Table {self.table}), instead of {self.instead_of}. For it: "
            f"{self.speaks_for} Against it: {self.speaks_against}"
        )


EACH_TRIAL = PaperReading(
    "statistics of each trial",
    "II",
    "statistics of a feature over all trials",
    'section IV-D writes "S_f = (f - mean(f)) / max(f)" of a feature f, and section III-B calls '
    'a feature a "time series" of a trial. Over all trials Methods I and II, and III and none, '
    "would each be one classifier after PCA's centring, while Table II has them up to 9.3 points "
    "apart.",
    'Methods I to IV "scale all three features within a uniform range", and "our original data" '
    "is scaled, which suggests one scale for all trials. Scaled by its own maximum, a trial no "
    "longer shows how hard it pressed.",
)
BY_MEAN = PaperReading(
    "coarse taxels by the mean",
    "I",
    "coarse taxels by the sum of the fine ones",
    'section III-B represents a frame "as a gray-scale image", and images are reduced by '
    "averaging.",
    "a larger taxel carries the sum of the forces on its area. The paper does not say how its "
    "coarse skins were made.",
)
READINGS = (EACH_TRIAL, BY_MEAN)


def scaled_by_trial(X: NDArray[np.float64], method: str) -> NDArray[np.float64]:
    """Eqs. 1 to 4 with the mean, maximum and deviation of each feature of each trial.

    Args:
        X: (n, p) feature vectors of the paper's features.
        method: none or I to IV; any other leaves X as it is.
    """
    f = X.reshape(len(X), len(FEATURES), -1)
    mean, largest = f.mean(axis=2, keepdims=True), np.abs(f).max(axis=2, keepdims=True)
    forms = {
        "I": (mean, largest),
        "II": (np.zeros_like(mean), largest),
        "III": (mean, np.ones_like(mean)),
        "IV": (mean, f.std(axis=2, keepdims=True)),
    }
    if method not in forms:
        return X
    shift, scale = forms[method]
    return np.asarray(((f - shift) / np.where(scale > 0.0, scale, 1.0)).reshape(X.shape))


def averaged(X: NDArray[np.float64], taxels: float) -> NDArray[np.float64]:
    """Feature vectors (n, p) of a skin that reads the mean of `taxels` where X has their sum.

    Thresholds are lower by the same factor, so the contacts are the same.
    """
    out = X.copy()
    columns = X.shape[1] // len(FEATURES)
    start = FEATURES.index("max_force") * columns
    out[:, start : start + columns] /= taxels
    return out


def section(context: Context, every: Sequence[Numbers]) -> Section | None:
    """The comparison of the readings; None for recordings that are not of a scene of ours."""
    if context.scene is None:
        return None
    theirs = {entry.key: entry.percent for entry in entries()}
    return compare(mean_of(every), theirs, len(every) * len(context.dataset.trials))


def compare(ours: Numbers, theirs: Numbers, tested: int) -> Section:
    """How well each combination of readings fits the paper's numbers.

    Args:
        ours: percent, with those of each reading under its `key`.
        theirs: the paper's percent.
        tested: number of trials behind each of ours.
    """
    rows = []
    for taken in product((False, True), repeat=len(READINGS)):
        chosen = {r.table: r.key for r, yes in zip(READINGS, taken, strict=True) if yes}
        groups: dict[tuple[str, str], list[tuple[float, float]]] = {}
        for (table, setting, task), percent in theirs.items():
            plain = ours.get((table, setting, task))
            read = ours.get((chosen.get(table, table), setting, task), plain)
            if read is not None:
                groups.setdefault((table, task), []).append((percent, read))
        pairs = np.array([pair for group in groups.values() for pair in group]).reshape(-1, 2)
        reach = np.array([difference(a, b, tested) for a, b in pairs.tolist()]).reshape(-1, 2)
        ranks = [rank_correlation(*zip(*group, strict=True)) for group in groups.values()]
        names = [r.name if yes else r.instead_of for r, yes in zip(READINGS, taken, strict=True)]
        within = ((reach[:, 0] <= 0.0) & (reach[:, 1] >= 0.0)).sum()
        rows.append(
            {
                "statistics": names[0],
                "coarse taxels": names[1],
                "within interval": f"{within} of {len(pairs)}",
                "mean distance": round(float(np.abs(pairs[:, 0] - pairs[:, 1]).mean()), 2),
                "lowest rank": round(min((r for r in ranks if r is not None), default=np.nan), 2),
            }
        )
    return Section(
        "Two readings of the paper",
        [
            "The other sections take the first reading of each sentence. That another combination "
            "fits better was noticed only afterwards, on the same numbers that judge it: it can "
            "explain, but it predicts nothing.",
            *(reading.text for reading in READINGS),
        ],
        [Table("paper_readings", "How well each combination of readings fits", rows)],
    )
