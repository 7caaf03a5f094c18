"""The paper's 46 accuracies, with their places (Tables I to III), and ours beside them."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import rankdata, spearmanr

from edge.statistics import wilson
from train.report.figures import STROKES, legend, picture
from train.report.section import Figure, Numbers, Row, Section, Table, counted

PAPER = Path(__file__).with_name("paper.csv")
TRIALS = 140
COPIES = 4000
"""Draws of the bootstrap that shows how a perfect copy would order the settings."""
SHOWN = 12
"""Most of the numbers outside the interval that the text lists."""


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

        Those are of all taxels, unscaled, with all features or with force and area alone: unscaled,
        a motion in metres has no weight beside them.
        """
        form = {"I": "384", "II": "none", "III": "max_force contact_area"}
        return self.setting == form[self.table]


def entries() -> list[Entry]:
    """All 46 numbers."""
    with open(PAPER, encoding="utf-8", newline="") as file:
        return [
            Entry(**{**row, "percent": float(row["percent"])})  # type: ignore[arg-type]
            for row in csv.DictReader(file)
        ]


def papers(table: str, task: str) -> dict[str, float]:
    """{setting: percent} of one of the paper's tables."""
    return {e.setting: e.percent for e in entries() if (e.table, e.task) == (table, task)}


def difference(paper: float, ours: float, tested: int) -> tuple[float, float]:
    """95 % interval of ours less the paper's, in points: Newcombe's, of two samples.

    Two studies of the same thing differ by the chance of both. An interval about one of them alone
    would exclude a perfect copy one time in six (Newcombe, Statistics in Medicine 17, 1998,
    method 10).

    Args:
        paper: percent of `TRIALS`.
        ours: percent.
        tested: number of trials behind ours.
    """
    (low_p, high_p), (low_o, high_o) = (
        100.0 * np.array(wilson(round(share * trials / 100.0), trials))
        for share, trials in ((paper, TRIALS), (ours, tested))
    )
    gap = ours - paper
    below = float(np.hypot(ours - low_o, high_p - paper))
    above = float(np.hypot(high_o - ours, paper - low_p))
    return round(gap - below, 2), round(gap + above, 2)


def mean_of(data_sets: Sequence[Numbers]) -> Numbers:
    """The mean over several data sets of each number that all of them have."""
    shared = set.intersection(*(set(numbers) for numbers in data_sets))
    return {key: float(np.mean([numbers[key] for numbers in data_sets])) for key in shared}


def negative_by_chance(percents: Sequence[float], tested: int) -> float:
    """Percent of perfect copies whose rank correlation with the paper would be below zero.

    A parametric bootstrap: the paper's percents are taken as true, and the trials of the paper and
    of the copy are drawn anew, independently for each setting. The settings of a table share their
    trials, so the result is rather too high than too low.

    Args:
        percents: of the settings.
        tested: number of trials behind each of the copy's.
    """
    rng = np.random.default_rng(0)
    truth = np.array(percents) / 100.0
    size = (COPIES, len(truth))
    pair = rng.binomial(TRIALS, truth, size) / TRIALS, rng.binomial(tested, truth, size) / tested
    paper, copy = (rankdata(x, axis=1) - (len(truth) + 1) / 2.0 for x in pair)
    return round(100.0 * float(np.mean((paper * copy).sum(axis=1) < 0.0)), 1)


def right_despite_the_object(numbers: Numbers) -> float:
    """Mean percent of the trials with a wrong object whose category is right.

    A right object implies the right category but for its other condition, so the amount by which
    category exceeds object is of trials whose object was wrong.

    Args:
        numbers: percent, with category and object of each setting.
    """
    shares = []
    for (table, setting, task), percent in numbers.items():
        named = numbers.get((table, setting, "object"), 100.0)
        if task == "category" and named < 100.0:
            shares.append(100.0 * (percent - named) / (100.0 - named))
    return float(np.mean(shares)) if shares else np.nan


def rank_correlation(theirs: ArrayLike, ours: ArrayLike) -> float | None:
    """Spearman's rank correlation; None where all values of one side are equal."""
    if np.ptp(theirs) == 0.0 or np.ptp(ours) == 0.0:
        return None
    return float(spearmanr(theirs, ours).statistic)


def comparison(data_sets: Sequence[Numbers], tested: int) -> Section:
    """Each of the paper's numbers beside ours, and the rank correlations.

    Args:
        data_sets: percent, of each data set.
        tested: number of trials behind their mean.
    """
    mean = mean_of(data_sets)
    known = {
        entry: _beside(entry, mean[entry.key], tested) for entry in entries() if entry.key in mean
    }
    rows = list(known.values())
    by_task: dict[tuple[str, str], list[Entry]] = {}
    for entry in known:
        by_task.setdefault((entry.table, entry.task), []).append(entry)
    ranks = [_ranks(settings, known, data_sets, tested) for settings in by_task.values()]
    inside = [row for row in rows if row["within"] == "yes"]
    others = [row for row in rows if not row["headline"]]
    others_inside = sum(not row["headline"] for row in inside)
    title = f"{len(inside)} of the paper's {len(known)} numbers lie within the interval"
    return Section(
        "Ours beside the paper's",
        [
            f"{len(inside)} of {len(rows)} numbers lie within the 95 % interval of the difference "
            f"between {tested} trials here ({counted(len(data_sets), 'simulated data set')}) and "
            f"the paper's {TRIALS}. {len(rows) - len(others)} of them repeat the three headline "
            "accuracies of section IV-A, which the free values of the scene were chosen to meet, "
            f"so there the scene predicts nothing. Of the other {len(others)}, {others_inside} lie "
            "within. The paper's trials and ours are of different objects; the interval covers the "
            "chance in both. Nothing was changed to meet the other numbers.",
            _disagreements([row for row in rows if row["within"] == "no"]),
            "A negative rank correlation means that the simulation gives no support to the paper's "
            "order of these settings. Two columns count the data sets in which it is positive and "
            "the perfect copies that would have a negative one by chance.",
            *_wrong_objects({e.key: e.percent for e in known}, mean),
        ],
        [
            Table("paper", "The paper's 46 numbers and ours", rows),
            Table(
                "paper_ranks",
                "Spearman's rank correlation of the settings' order here and in the paper",
                ranks,
                narrow=5,
            ),
        ],
        [_against(known, title)],
    )


def _beside(entry: Entry, ours: float, tested: int) -> Row:
    """The row of one number, with ours in percent of the trials tested."""
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


def _ranks(
    settings: Sequence[Entry], known: Mapping[Entry, Row], data_sets: Sequence[Numbers], tested: int
) -> Row:
    """The row of the settings of one task in one of the paper's tables."""
    theirs = [entry.percent for entry in settings]
    ours = [[numbers[entry.key] for entry in settings] for numbers in data_sets]
    rank = rank_correlation(theirs, np.mean(ours, axis=0))
    positive = sum((rank_correlation(theirs, percents) or 0.0) > 0.0 for percents in ours)
    within = sum(known[entry]["within"] == "yes" for entry in settings)
    return {
        "table": settings[0].table,
        "task": settings[0].task,
        "rank correlation": "all equal" if rank is None else round(rank, 2),
        "positive in data sets": f"{positive} of {len(data_sets)}",
        "perfect copies below zero %": negative_by_chance(theirs, tested),
        "within interval": f"{within} of {len(settings)}",
    }


def _wrong_objects(theirs: Numbers, ours: Numbers) -> list[str]:
    """A paragraph on the categories of trials whose object was wrong."""
    paper, here = (right_despite_the_object({k: n[k] for k in theirs}) for n in (theirs, ours))
    if np.isnan(paper) or np.isnan(here):
        return []
    return [
        "Over all settings that have both tasks, of the trials whose object was wrong, "
        f"{paper:.0f} % have the right category in the paper and {here:.0f} % here; a guess among "
        "four categories has 25 %. A higher share means that objects of one category feel more "
        "alike: a skin too coarse to recognise the object still recognises its category."
    ]


def _disagreements(outside: Sequence[Row]) -> str:
    """A paragraph on the numbers outside their interval."""
    if not outside:
        return "No number lies outside."
    largest = sorted(outside, key=lambda row: -abs(row["difference"]))[:SHOWN]
    listed = [f"{r['place']} ({r['task']}) {r['difference']:+.1f} points" for r in largest]
    higher = sum(row["difference"] > 0 for row in outside)
    return (
        f"{len(outside)} lie outside, {higher} of them higher here than in the paper. The largest "
        f"differences: {'; '.join(listed)}. A higher number means that the simulation gives "
        "information that the real skin did not; a lower one, that it lacks some. In Table II some "
        "of the paper's methods are one classifier, see the section on scaling."
    )


def _against(known: Mapping[Entry, Row], title: str) -> Figure:
    """Ours against the paper's, a point a number; hollow where its bar misses the diagonal."""
    marks = dict(zip(dict.fromkeys(e.table for e in known), "os^", strict=False))
    strokes = dict(zip(sorted({e.task for e in known}), STROKES, strict=False))
    ends = min(min(row["paper %"], row["ours %"]) for row in known.values()) - 4.0, 102.0

    def draw(canvas: Any, phone: bool) -> None:
        axes = canvas.subplots()
        axes.plot(ends, ends, color="0.4", lw=1, label="equal")
        for entry, row in known.items():
            colour, _, dashes = strokes[entry.task]
            face = colour if row["within"] == "yes" else "white"
            bar = [entry.percent + row["from"], entry.percent + row["to"]]
            axes.plot([entry.percent] * 2, bar, color=colour, lw=1, alpha=0.6, ls=dashes)
            style = {"color": colour, "mfc": face, "ms": 6}
            axes.plot(entry.percent, row["ours %"], marks[entry.table], **style)
        for task, (colour, _, dashes) in strokes.items():
            axes.plot([], [], ls=dashes, color=colour, lw=2, label=task)
        for table, mark in marks.items():
            axes.plot([], [], mark, color="0.3", label=f"Table {table}")
        axes.plot([], [], "o", color="0.3", mfc="white", label="outside")
        axes.set(xlim=ends, ylim=ends, xlabel="the paper's accuracy, %", ylabel="ours, %")
        legend(canvas, axes, 3 if phone else 4)

    return picture("paper", title, draw, (5.6, 4.4))
