"""The paper's 46 accuracies, with their places (Tables I to III), and ours beside them."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.stats import spearmanr

from edge.commands.summary import wilson
from train.report.tables import Section, Table, percent
from train.study.context import Context

Numbers = dict[tuple[str, str, str], float]
"""{(table, setting, task): accuracy in percent}."""
PAPER = Path(__file__).with_name("paper.csv")
TRIALS = 140


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


def section(context: Context) -> Section:
    """Each of the paper's numbers beside ours, and the rank correlations."""
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
    pairs: dict[tuple[str, str], list[tuple[float, float]]] = {}
    inside = free = free_inside = 0
    for entry in entries():
        ours = context.ours.get((entry.table, entry.setting, entry.task))
        if ours is None:
            continue
        low, high = difference(entry.percent, ours, context.tested)
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
        pairs.setdefault((entry.table, entry.task), []).append((entry.percent, ours))
    ranks = Table(
        "paper_ranks",
        "Does ours order the settings as the paper does? Spearman's rank correlation",
        ("table", "task", "settings", "rank correlation", "mean difference", "within interval"),
    )
    for (table, task), values in pairs.items():
        theirs, ours_too = np.array(values).T
        varies = np.ptp(ours_too) > 0 and np.ptp(theirs) > 0
        rank = (
            round(float(spearmanr(theirs, ours_too).statistic), 2) if varies else "none: all equal"
        )
        within = sum(
            row[-1] == "yes"
            for row in side.rows
            if row[0].startswith(f"Table {table},") and row[1] == task
        )
        mean = round(float((ours_too - theirs).mean()), 2)
        ranks.rows.append((table, task, len(values), rank, mean, f"{within} of {len(values)}"))
    found = Section(
        "Ours beside the paper's",
        [
            f"{inside} of {len(side.rows)} numbers lie within the 95 % interval of the difference "
            f"between {context.tested} trials here ({context.seeds} simulated data "
            f"set{'s' if context.seeds > 1 else ''}) and the paper's {TRIALS}. "
            f"{len(side.rows) - free} of them are the three headline accuracies of section IV-A, "
            "again in each table: a scene whose free values were searched until it met these, as "
            "the head of cody18 says of itself, predicts nothing there. Of the other "
            f"{free}, {free_inside} lie within. The paper's accuracies and ours are of different "
            "trials of different objects: the interval says what chance in both explains. What the "
            "simulation was held to, and what it predicts, stands at the head of its scene's file; "
            "nothing was moved to meet the other numbers.",
            *_disagreements(side, ranks),
        ],
        [side, ranks],
    )
    return found


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
    backwards = [r for r in ranks.rows if isinstance(r[3], float) and r[3] < 0]
    if backwards:
        text.append(
            "Ordered against the paper: "
            + "; ".join(f"Table {r[0]}, {r[1]} ({r[3]:+.2f})" for r in backwards)
            + ". There the simulation cannot speak for the paper's conclusion."
        )
    return text
