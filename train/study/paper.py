"""The paper's 46 accuracies, with their places (Tables I to III), and ours beside them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import rankdata, spearmanr

from edge.commands.summary import wilson
from train.report import figures
from train.report.tables import Figure, Section, Table, percent

Numbers = dict[tuple[str, str, str], float]
"""{(table, setting, task): accuracy in percent}."""
PAPER = Path(__file__).with_name("paper.csv")
TRIALS = 140
COPIES = 4000
"""Draws of the bootstrap that tells how a perfect copy would be ordered."""


@dataclass(frozen=True)
class Entry:
    """One number of the paper.

    Attributes:
        place: where it stands.
        table: I, II or III.
        setting: taxels, scaling or features, as the study names them.
        task: category, mobility or object.
        percent: leave-one-out accuracy.
        k, components: of the best cell where the paper gives them, else "".
    """

    place: str
    table: str
    setting: str
    task: str
    percent: float
    k: str
    components: str

    @property
    def headline(self) -> bool:
        """It is one of the three accuracies of section IV-A: all taxels, unscaled, and either all
        features or force and area (unscaled, motion in metres weighs nothing beside them)."""
        form = {"I": "384", "II": "none", "III": "max_force contact_area"}
        return self.setting == form[self.table]

    @property
    def interval(self) -> tuple[float, float]:
        """95 % binomial interval of 140 trials, in percent."""
        low, high = wilson(round(self.percent * TRIALS / 100.0), TRIALS)
        return percent(low), percent(high)


def difference(paper: float, ours: float, tested: int) -> tuple[float, float]:
    """95 % interval of ours less the paper's, in percent: Newcombe's, of two samples.

    Two studies of the same thing differ by the chance of both; an interval about one of them alone
    would leave out a perfect copy one time in six (Newcombe, Statistics in Medicine 17, 1998,
    method 10).

    Args:
        paper: percent of `TRIALS`.
        ours: percent.
        tested: trials behind ours.
    """
    low_p, high_p = (100.0 * x for x in wilson(round(paper * TRIALS / 100.0), TRIALS))
    low_o, high_o = (100.0 * x for x in wilson(round(ours * tested / 100.0), tested))
    gap = ours - paper
    below = float(np.hypot(ours - low_o, high_p - paper))
    above = float(np.hypot(high_o - ours, paper - low_p))
    return round(gap - below, 2), round(gap + above, 2)


def mean_of(every: Sequence[Numbers]) -> Numbers:
    """The mean over several data sets of each number that all have."""
    shared = set.intersection(*(set(one) for one in every))
    return {key: float(np.mean([one[key] for one in every])) for key in shared}


def entries() -> list[Entry]:
    """All 46."""
    with open(PAPER, encoding="utf-8", newline="") as file:
        return [
            Entry(**{**row, "percent": float(row["percent"])})  # type: ignore[arg-type]
            for row in csv.DictReader(file)
        ]


def negative_by_chance(percents: Sequence[float], tested: int) -> float:
    """Percent of perfect copies whose rank correlation with the paper would be below zero.

    A parametric bootstrap: the paper's percents are taken for the truth, and its trials and the
    copy's are drawn anew, each setting on its own. The settings of a table share their trials, so
    this is rather too much than too little.

    Args:
        percents: of the settings.
        tested: trials behind each of the copy's.
    """
    rng = np.random.default_rng(0)
    truth = np.array(percents) / 100.0
    size = (COPIES, len(truth))
    pair = rng.binomial(TRIALS, truth, size) / TRIALS, rng.binomial(tested, truth, size) / tested
    paper, copy = (rankdata(x, axis=1) - (len(truth) + 1) / 2.0 for x in pair)
    return round(100.0 * float(np.mean((paper * copy).sum(axis=1) < 0.0)), 1)


def right_despite_the_object(numbers: Numbers) -> float:
    """Percent of trials told a wrong object whose category is right, a mean over the settings.

    Whoever tells the right object tells the right category but for its other condition, so what
    category has more than object is of trials whose object was told wrong.

    Args:
        numbers: percent, with category and object of each setting.
    """
    pairs = [
        (percent, numbers[table, setting, "object"])
        for (table, setting, task), percent in numbers.items()
        if task == "category" and (table, setting, "object") in numbers
    ]
    return float(np.mean([100.0 * (a - b) / (100.0 - b) for a, b in pairs if b < 100.0]))


def section(every: Sequence[Numbers], tested: int) -> Section:
    """Each of the paper's numbers beside ours, and the rank correlations.

    Args:
        every: percent, of each data set.
        tested: trials behind their mean.
    """
    mean = mean_of(every)
    known = [(entry, (entry.table, entry.setting, entry.task)) for entry in entries()]
    known = [(entry, key) for entry, key in known if key in mean]
    side = Table(
        "paper",
        "The paper's 46 numbers and ours",
        (
            "place",
            "task",
            "paper %",
            "ours %",
            "difference",
            "from",
            "to",
            "headline",
            "within",
        ),
    )
    tables: dict[tuple[str, str], list[tuple[str, str, str]]] = {}
    inside = free = free_inside = 0
    for entry, key in known:
        ours = mean[key]
        low, high = difference(entry.percent, ours, tested)
        hit = low <= 0.0 <= high
        inside += hit
        free += not entry.headline
        free_inside += hit and not entry.headline
        gap = round(ours - entry.percent, 2)
        cells = (
            entry.place,
            entry.task,
            entry.percent,
            round(ours, 2),
            gap,
            low,
            high,
            "yes" if entry.headline else "",
        )
        side.rows.append((*cells, "yes" if hit else "no"))
        tables.setdefault((entry.table, entry.task), []).append(key)
    theirs = {key: entry.percent for entry, key in known}
    ranks = Table(
        "paper_ranks",
        "Does ours order the settings as the paper does? Spearman's rank correlation",
        (
            "table",
            "task",
            "rank correlation",
            "positive in data sets",
            "perfect copies below zero %",
            "settings",
            "mean difference",
            "within interval",
        ),
        narrow=5,
    )
    for (table, task), keys in tables.items():
        given = [theirs[key] for key in keys]
        rank = rank_correlation(given, [mean[key] for key in keys])
        alone = [rank_correlation(given, [one[key] for key in keys]) for one in every]
        positive = sum(r is not None and r > 0.0 for r in alone)
        within = sum(
            row[-1] == "yes"
            for row in side.rows
            if row[0].startswith(f"Table {table},") and row[1] == task
        )
        ranks.rows.append(
            (
                table,
                task,
                "none: all equal" if rank is None else round(rank, 2),
                f"{positive} of {len(every)}",
                negative_by_chance(given, tested),
                len(keys),
                round(float(np.mean([mean[key] - theirs[key] for key in keys])), 2),
                f"{within} of {len(keys)}",
            )
        )
    points = [(f"Table {e.table}", e.task, e.percent, mean[key]) for e, key in known]
    reach = [(row[2] + row[5], row[2] + row[6]) for row in side.rows]
    title = f"{inside} of the paper's {len(known)} numbers lie within the interval"
    return Section(
        "Ours beside the paper's",
        [
            f"{inside} of {len(side.rows)} numbers lie within the 95 % interval of the difference "
            f"between {tested} trials here ({len(every)} simulated data "
            f"set{'s' if len(every) > 1 else ''}) and the paper's {TRIALS}. "
            f"{len(side.rows) - free} of them are the three headline accuracies of section IV-A, "
            "again in each table: a scene whose free values were searched until it met these, as "
            "the head of cody18 says of itself, predicts nothing there. Of the other "
            f"{free}, {free_inside} lie within. The paper's accuracies and ours are of different "
            "trials of different objects: the interval says what chance in both explains. What the "
            "simulation was held to, and what it predicts, stands at the head of its scene's file; "
            "nothing was moved to meet the other numbers.",
            *_disagreements(side, ranks),
            *_wrong_objects(theirs, mean),
        ],
        [side, ranks],
        [Figure("paper", title, figures.against(points, reach, title=title))],
    )


def rank_correlation(theirs: Sequence[float], ours: Sequence[float]) -> float | None:
    """Spearman's; None where one side is all equal."""
    if np.ptp(theirs) == 0.0 or np.ptp(ours) == 0.0:
        return None
    return float(spearmanr(theirs, ours).statistic)


def _wrong_objects(theirs: Numbers, ours: Numbers) -> list[str]:
    """What telling a wrong object says of the category, in the paper and here."""
    shared = {key: percent for key, percent in theirs.items() if key in ours}
    if not any(task == "object" for _, _, task in shared):
        return []
    paper, here = (right_despite_the_object({k: n[k] for k in shared}) for n in (shared, ours))
    return [
        "Over all settings that have both, category is above object by so much that, of the "
        f"trials told a wrong object, {paper:.0f} % are told the right category in the paper and "
        f"{here:.0f} % here; a guess among four categories has 25 %. The more it is, the more "
        "alike the objects of a category feel, so that what is too coarse to tell an object still "
        "tells its category."
    ]


def _disagreements(side: Table, ranks: Table) -> list[str]:
    """What the table says, in words."""
    outside = sorted((row for row in side.rows if row[-1] == "no"), key=lambda r: -abs(r[4]))
    if not outside:
        return ["No number lies outside."]
    text = [
        "Outside, the largest first: "
        + "; ".join(f"{r[0]} ({r[1]}) {r[4]:+.2f} points" for r in outside[:12])
        + ("; and more in the table." if len(outside) > 12 else ".")
    ]
    scaled = [row for row in outside if row[0].startswith("Table II,")]
    skin = [row for row in outside if row not in scaled]
    higher = sum(row[4] > 0 for row in skin)
    if skin:
        text.append(
            f"Of the {len(skin)} outside in Tables I and III, {higher} are higher here, "
            f"{len(skin) - higher} lower. "
            "Higher means that the simulation holds information which the real skin did not give "
            "(it repeats too well, or its noise, covers and drift are too kind); lower, that it "
            "lacks some that the real contacts had."
        )
    if scaled:
        text.append(
            f"The {len(scaled)} outside in Table II say less of the simulation than of what the "
            "paper's scaling was: by Eqs. 1 to 5 some of its methods are one classifier, which "
            "the paper gives several accuracies (see there)."
        )
    backwards = [r for r in ranks.rows if isinstance(r[2], float) and r[2] < 0]
    if backwards:
        text.append(
            "Ordered against the paper: "
            + "; ".join(
                f"Table {r[0]}, {r[1]} ({r[2]:+.2f}; positive in {r[3]} data sets; of perfect "
                f"copies {r[4]:g} % would be negative)"
                for r in backwards
            )
            + ". There the simulation cannot speak for the paper's conclusion."
        )
    return text
