"""The paper's 46 accuracies in its Tables I to III, compared with ours."""

import csv
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from edge.decide.statistics import wilson
from edge.errors import counted
from train.report.section import Row, Section, Table

Numbers = dict[tuple[str, str, str], float]
"""{(table, setting, task): accuracy in percent}."""
PAPER = Path(__file__).with_name("paper.csv")
TRIALS = 140
LISTED = 12
"""The text lists at most so many of the numbers outside the interval."""


@dataclass(frozen=True)
class Entry:
    """One number of the paper.

    Attributes:
        place: its place in the paper.
        table: I, II or III.
        setting: taxels, scaling or features, as the study names them.
        task: category, mobility or object.
        percent: leave-one-out accuracy.
    """

    place: str
    table: str
    setting: str
    task: str
    percent: float

    @property
    def key(self) -> tuple[str, str, str]:
        """The key of this number in `Numbers`."""
        return self.table, self.setting, self.task

    @property
    def headline(self) -> bool:
        """Whether it is one of the three accuracies of section IV-A.

        They use all taxels without scaling. Table III repeats them for force and area
        alone, because unscaled motion in metres has no weight beside these.
        """
        settings = {"I": "384", "II": "none", "III": "max_force contact_area"}
        return self.setting == settings[self.table]


def entries() -> list[Entry]:
    """All 46 numbers."""
    with open(PAPER, encoding="utf-8", newline="") as file:
        return [
            Entry(**{**row, "percent": float(row["percent"])})  # type: ignore[arg-type]
            for row in csv.DictReader(file)
        ]


def papers(table: str, task: str) -> dict[str, float]:
    """{setting: the paper's percent} for a task in one of its tables."""
    return {
        e.setting: e.percent for e in entries() if (e.table, e.task) == (table, task)
    }


def difference(paper: float, ours: float, tested: int) -> tuple[float, float]:
    """95 % interval of our accuracy minus the paper's, in percentage points.

    Two studies of the same question differ by chance in both. An interval around one of
    them alone would exclude a perfect replication one time in six (Newcombe, Statistics
    in Medicine 17, 1998, method 10, for two samples).

    Args:
        paper: percent of `TRIALS`.
        ours: percent.
        tested: number of our trials.
    """
    low_p, high_p = _interval(paper, TRIALS)
    low_o, high_o = _interval(ours, tested)
    gap = ours - paper
    below = math.hypot(ours - low_o, high_p - paper)
    above = math.hypot(high_o - ours, paper - low_p)
    return round(gap - below, 2), round(gap + above, 2)


def _interval(percent: float, trials: int) -> tuple[float, float]:
    """The 95 % interval of an accuracy, in percent."""
    low, high = wilson(round(percent * trials / 100.0), trials)
    return 100.0 * low, 100.0 * high


def mean_of(data_sets: Sequence[Numbers]) -> Numbers:
    """The mean over several data sets of each number that all of them have."""
    shared = set.intersection(*map(set, data_sets))
    return {
        key: float(np.mean([numbers[key] for numbers in data_sets])) for key in shared
    }


def comparison(data_sets: Sequence[Numbers], tested: int) -> Section:
    """Each of the paper's accuracies beside ours.

    Args:
        data_sets: our percents, for each data set.
        tested: number of trials in all data sets together.
    """
    mean = mean_of(data_sets)
    shared = [entry for entry in entries() if entry.key in mean]
    rows = [_beside(entry, mean[entry.key], tested) for entry in shared]
    # {(within the interval, a headline): number}
    counts = Counter((row["within"], row["headline"]) for row in rows)
    predicted = counts["yes", ""]
    inside = predicted + counts["yes", "yes"]
    predictions = predicted + counts["no", ""]
    title = (
        f"Our accuracies against the paper's: {inside} of {len(rows)} within the "
        "interval"
    )
    return Section(
        "Ours beside the paper's",
        [
            f"The paper's Tables I to III give {len(rows)} accuracies. The simulation "
            f"agrees with {inside} of them: the 95 % interval of the difference "
            f"contains zero. The interval allows for chance in the {tested} trials "
            f"here ({counted(len(data_sets), 'simulated data set')}) and in the "
            f"paper's {TRIALS}. The objects touched are not the same.",
            f"{len(rows) - predictions} of the {len(rows)} repeat the three "
            "headline accuracies of the paper's section IV-A. The free values of the "
            "scene were chosen to meet these, so they are no predictions. Of the other "
            f"{predictions}, {predicted} agree. Nothing was changed to meet them.",
            _disagreements([row for row in rows if row["within"] == "no"]),
        ],
        [Table("paper", title, rows)],
    )


def _beside(entry: Entry, ours: float, tested: int) -> Row:
    """The table's row for one of the paper's numbers.

    Args:
        entry: the paper's number.
        ours: our percent.
        tested: number of our trials.
    """
    low, high = difference(entry.percent, ours, tested)
    return {
        "place": entry.place,
        "task": entry.task,
        "paper %": entry.percent,
        "ours %": round(ours, 2),
        "difference": round(ours - entry.percent, 2),
        "from": low,
        "to": high,
        "headline": "yes" if entry.headline else "",
        "within": "yes" if low <= 0.0 <= high else "no",
    }


def _disagreements(outside: Sequence[Row]) -> str:
    """A paragraph on the numbers outside their interval."""
    if not outside:
        return "No accuracy disagrees."
    largest = sorted(outside, key=lambda row: -abs(row["difference"]))[:LISTED]
    listed = [
        f"{r['place']} ({r['task']}) {r['difference']:+.1f} points" for r in largest
    ]
    higher = sum(row["difference"] > 0 for row in outside)
    return (
        f"{len(outside)} disagree; {higher} of them are higher here than in the paper. "
        f"The largest differences are {'; '.join(listed)}. A higher accuracy means "
        "that the simulated skin gives information that the real skin did not give; a "
        "lower one means that it lacks some. In Table II some of the paper's methods "
        "are the same classifier; see the section on scaling."
    )
