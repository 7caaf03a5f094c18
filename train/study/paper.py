"""The paper's 46 accuracies in its Tables I to III, compared with ours."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd

from edge.decide.statistics import wilson
from edge.errors import counted
from train.report.section import ReportTable, Section

Numbers = Mapping[tuple[str, str, str], float]
"""{(table, setting, task): accuracy in percent}."""
PAPER = pd.read_csv(Path(__file__).with_suffix(".csv"), dtype={"setting": str})
"""A row for each number: its place in the paper; table, setting and task, as the study
names them; percent, of leave-one-out accuracy."""
TRIALS = 140
HEADLINES = {"I": "384", "II": "none", "III": "max_force contact_area"}
"""{table: the setting of the three accuracies of section IV-A}.

They use all taxels without scaling. Table III repeats them for force and area alone,
because unscaled motion in metres has no weight beside these.
"""


def papers(table: str, task: str) -> dict[str, float]:
    """{setting: the paper's percent} for a task in one of its tables."""
    rows = PAPER[(PAPER.table == table) & (PAPER.task == task)]
    return dict(zip(rows.setting, rows.percent, strict=True))


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


def comparison(data_sets: Sequence[Numbers], tested: int) -> Section:
    """Each of the paper's accuracies beside the mean of ours.

    Args:
        data_sets: our percents, for each data set.
        tested: number of trials in all data sets together.
    """
    rows = []
    for place, *key, percent in PAPER.itertuples(index=False):
        numbers = [data_set.get(tuple(key), math.nan) for data_set in data_sets]
        ours = math.fsum(numbers) / len(numbers)
        if not math.isnan(ours):
            table, setting, task = key
            low, high = difference(percent, ours, tested)
            rows.append(
                {
                    "place": place,
                    "task": task,
                    "paper %": percent,
                    "ours %": round(ours, 2),
                    "difference": round(ours - percent, 2),
                    "from": low,
                    "to": high,
                    "headline": "yes" if setting == HEADLINES[table] else "",
                    "within": "yes" if low <= 0.0 <= high else "no",
                }
            )
    inside = sum(row["within"] == "yes" for row in rows)
    predictions = [row["within"] for row in rows if not row["headline"]]
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
            f"{len(rows) - len(predictions)} of the {len(rows)} repeat the three "
            "headline accuracies of the paper's section IV-A. The free values of the "
            "scene were chosen to meet these, so they are no predictions. Of the other "
            f"{len(predictions)}, {predictions.count('yes')} agree. Nothing was changed "
            "to meet them. A higher accuracy means that the simulated skin gives "
            "information that the real skin did not give; a lower one means that it "
            "lacks some. In Table II some of the paper's methods are the same "
            "classifier; see the section on scaling.",
        ],
        [ReportTable("paper", title, rows)],
    )
