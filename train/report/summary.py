"""A fit summed up for a terminal: the candidates, the choices, and warnings."""

import os
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path

from edge.decide.summary import doubt
from edge.errors import counted, printable
from edge.features import names as measures
from train.choose.settings import Chosen
from train.data.dataset import DataSet
from train.data.feature_sets import SETS, expand, moves
from train.data.groups import TRIAL
from train.fitted import Fitted
from train.model.pipeline import Choice
from train.report.score import interval
from train.report.section import ReportTable, Row

Prices = Sequence[tuple[float, float]]
"""Microseconds of a decision on this machine, and kilobytes, for each candidate."""


def summary(fitted: Fitted, most_lines: int | None = None) -> list[str]:
    """The accuracy of each task, what was chosen, doubts and notes, as lines of text.

    Args:
        fitted: the result of `train.fit`.
        most_lines: notes beyond them are counted, those last that are no warnings.
    """
    lines = [f"{task}: {accuracy(chosen)}" for task, chosen in fitted.chosen.items()]
    tasks_of: dict[str, list[str]] = {}
    for task, chosen in fitted.chosen.items():
        tasks_of.setdefault(_described(chosen.choice, fitted), []).append(task)
    lines += [
        f"settings of {', '.join(tasks)}: {text}" for text, tasks in tasks_of.items()
    ]
    lines += doubt({} if fitted.sequential is None else fitted.sequential.stopping_)
    lines += sorted(fitted.notes, key=lambda note: not note.startswith("warning: "))
    if most_lines is None or len(lines) <= most_lines:
        return lines
    more = counted(len(lines) - most_lines + 1, "note")
    return [*lines[: most_lines - 1], f"{more} more in the report and with --verbose"]


def details(fitted: Fitted, prices: Prices) -> list[str]:
    """The candidates, the settings of early decisions, and the features with their
    units, as lines of text."""
    lines = [
        candidates(fitted, prices).frame.to_string(index=False),
        "* chosen; in brackets, the 95 % interval of the accuracy on other trials; "
        "- dropped after a few folds, as behind or no better than a cheaper one",
    ]
    if fitted.early is not None:
        before = f"before {fitted.window_s:g} s"
        for task, choice in fitted.early.choices.items():
            lines.append(f"{task}, {before}: {_described(choice, fitted)}")
    lines += _by_unit(fitted.dataset.units)
    if any(map(moves, map(measures.feature, fitted.dataset.names))):
        frame = "along the skin" if fitted.dataset.chain is None else "in the world"
        lines.append(f"contact motion is measured {frame}")
    return lines


def _by_unit(units: Mapping[str, str]) -> list[str]:
    """A line for each unit, with its features, from {feature: its unit}."""
    features: dict[str, list[str]] = {}
    for name, unit in units.items():
        words = "without unit" if unit == "1" else f"in {unit}"
        features.setdefault(words, []).append(name)
    return [f"{words}: {', '.join(names)}" for words, names in features.items()]


def candidates(fitted: Fitted, prices: Prices) -> ReportTable:
    """A row for each candidate that was not dropped, with the nested accuracy of its
    own settings and its price."""
    rows: list[Row] = []
    for i, candidate in enumerate(fitted.candidates):
        pairs = {(grid.features, grid.projection) for grid in candidate.grids}
        if not any(chosen.candidates[i] for chosen in fitted.chosen.values()):
            continue
        row: Row = {"features": candidate.name, "projection": candidate.projection}
        for task, chosen in fitted.chosen.items():
            choice = chosen.choice
            star = "*" if (choice.features, choice.projection) in pairs else " "
            result = chosen.candidates[i]
            row[task] = "- "
            if result is not None:
                row[task] = f"{result.accuracy:.1%} ({interval(result)}){star}"
        us, kilobytes = prices[i]
        row["us per decision"] = round(us, 1)
        row["kB"] = round(kilobytes, 1)
        rows.append(row)
    return ReportTable("candidates", "Candidates", rows, ("us per decision",))


def accuracy(chosen: Chosen) -> str:
    """The nested accuracy of a task in words."""
    result = chosen.accuracy
    text = (
        f"{result.accuracy:.1%} of {result.total} trials are right (95 % interval "
        f"{interval(result)}), each held out"
    )
    if chosen.held_out == TRIAL:
        return text
    alone = f"{chosen.by_trial.accuracy:.1%} where it is held out alone"
    return f"{text} with all of its {chosen.held_out}; {alone}"


def _described(choice: Choice, fitted: Fitted) -> str:
    """The settings of a choice as text."""
    combinations = {expand([name]): name for name in SETS}
    for candidate in reversed(fitted.candidates):
        combinations |= {grid.features: candidate.name for grid in candidate.grids}
    name = combinations.get(choice.features, " ".join(choice.features))
    how = f"{choice.projection} of {name}, scaling {choice.scaling}"
    if choice.projection == "lda":
        how += f", shrinkage {choice.shrinkage:g}"
        if choice.targets:
            how += f", with the discriminants of {' and '.join(choice.targets)} side by side"
    return f"{how}, {counted(choice.components, 'component')}, k = {choice.k}"


def names(dataset: DataSet) -> tuple[str, tuple[str, ...]]:
    """The name of the folder that holds all recordings, and each trial's path in it.

    The paths have no suffix. If a recording has several trials, they are numbered from
    1. Names that are no text have escapes.
    """
    paths = [trial.path.resolve() for trial in dataset.trials]
    folder = Path(os.path.commonpath([path.parent for path in paths]))
    counts = Counter(paths)
    numbers = Counter[Path]()
    trials = []
    for path in paths:
        name = printable(path.relative_to(folder).with_suffix("").as_posix())
        if counts[path] > 1:
            numbers[path] += 1
            name += f" {numbers[path]}"
        trials.append(name)
    return printable(folder.name), tuple(trials)
