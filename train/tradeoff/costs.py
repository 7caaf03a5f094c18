"""What each way to save time or work costs in accuracy, in one table of the same shape."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from edge.recording import Recording
from edge.touch.features import WINDOW_S
from train.choose import Chosen
from train.dataset import DataSet, Recordings
from train.evaluate import Result, stratified_folds
from train.report.score import paired
from train.report.section import Row, Section, Table, counted
from train.report.skins import pooled_down, pooled_layout
from train.report.work import Workers
from train.stopping import finest
from train.tradeoff.choices import Points, chosen, followed, some
from train.tradeoff.measured import Measured, Saving
from train.tradeoff.wires import Wire, wires

WAITS_S = (0.8, 0.6, 0.4)
EVERY = (2, 4)
"""Of so many frames one is read."""
PARTS = (2, 4)
"""Parts of the trials of which one is kept."""
FEWEST = 20
"""Trials below which no choice is made."""
Hits = Mapping[tuple[Path, int], bool]
"""{(recording, number of its contact): whether the answer is right}."""


@dataclass(frozen=True)
class Change:
    """One change, and the choice made with it.

    Attributes:
        what: the change.
        cost: what it saves or costs, other than accuracy.
        source: the trials, or recordings that are followed again.
        window_s: seconds from onset.
        given: options of the choice.
        fewer: whether trials are left out on purpose; otherwise a contact that is no longer
            noticed counts as wrong.
    """

    what: str
    cost: str
    source: DataSet | Recordings
    window_s: float = WINDOW_S
    given: Mapping[str, Any] = field(default_factory=dict)
    fewer: bool = False


def every_nth(recording: Recording, n: int) -> Recording:
    """The recording of a wire that carries every n-th frame only."""
    joints = None if recording.joints is None else recording.joints[::n]
    valid = recording.valid
    return replace(
        recording,
        t=recording.t[::n],
        frames=recording.frames[::n],
        joints=joints,
        valid=valid[::n] if valid is not None and valid.ndim == 3 else valid,
    )


def _changed(raw: Recordings, change: Callable[[Recording], Recording]) -> Recordings:
    return replace(raw, recordings=tuple(map(change, raw.recordings)))


def changes(raw: Recordings, dataset: DataSet) -> list[Change]:
    """Every change that the table shows, but for the windows, which are measured anyway."""
    rate = float(np.median([1.0 / np.median(np.diff(r.t)) for r in raw.recordings]))
    cases = []
    for n in EVERY:
        carried = [w.name for w in wires(dataset.layout) if w.every(rate) == n]
        cost = f"enough: {carried[0]}" if carried else f"1/{n} of the bits on the wire"
        source = _changed(raw, partial(every_nth, n=n))
        cases.append(Change(f"{rate / n:.0f} frames a second", cost, source))
    coarse, steps, full = dataset.layout, [], _last(wires(dataset.layout))
    while coarse.rows * coarse.cols > 1:
        coarse = pooled_layout(coarse)
        steps.append(coarse)
        taxels = coarse.rows * coarse.cols
        if 1 < taxels < 4:
            continue
        source = _changed(raw, partial(pooled_down, layouts=tuple(steps), by=np.add))
        saved = 1e3 * (full.frame_s - _last(wires(coarse)).frame_s)
        cost = f"a frame {saved:.1f} ms shorter on 1 bus of AD7147"
        cases.append(Change(counted(taxels, "taxel"), cost, source))
    cases.append(Change("the paper's features", "", dataset, given={"features": ["paper"]}))
    y = {task: dataset.labels(task) for task in dataset.tasks}
    for part in PARTS:
        rows = np.flatnonzero(stratified_folds(y[finest(y)], part) == 0)
        if len(rows) >= FEWEST:
            what = f"{len(rows)} of {len(dataset.trials)} trials"
            cases.append(Change(what, "less to record", some(dataset, rows), fewer=True))
    return cases


def _last(choices: Sequence[Wire]) -> Wire:
    """The slowest wiring, of fewest buses."""
    return max((w for w in choices if w.name.startswith("AD7147")), key=lambda w: w.frame_s)


def hits(dataset: DataSet, result: Result) -> Hits:
    """Which trials are answered right."""
    assert result.hits is not None
    seen: Counter[Path] = Counter()
    answered = {}
    for trial, hit in zip(dataset.trials, result.hits.tolist(), strict=True):
        answered[trial.path, seen[trial.path]] = hit
        seen[trial.path] += 1
    return answered


def answered(change: Change) -> dict[str, Hits]:
    """{task: the answers of the choice with a change}."""
    source = change.source
    dataset = source if isinstance(source, DataSet) else followed(source)
    made = chosen(dataset, change.window_s, **change.given)
    return {task: hits(dataset, choice.by_trial) for task, choice in made.items()}


def difference(before: Hits, after: Hits, *, fewer: bool) -> tuple[float, float, float]:
    """The points gained by a change, and their 95 % interval, on the same trials."""
    trials = list(after if fewer else before)
    return paired(
        np.array([before[trial] for trial in trials]),
        np.array([after.get(trial, False) for trial in trials]),
    )


def measure(raw: Recordings, dataset: DataSet, points: Points, workers: Workers) -> list[Saving]:
    """Every change beside the choice at `WINDOW_S` on the recordings as they are."""

    def of(tasks: Mapping[str, Chosen]) -> dict[str, Hits]:
        return {task: hits(dataset, choice.by_trial) for task, choice in tasks.items()}

    base = of(points[WINDOW_S])
    waits = [Change(f"waiting {w:g} s", f"{w - WINDOW_S:+.1f} s", dataset, w) for w in WAITS_S]
    cases = changes(raw, dataset)
    afters = [of(points[wait.window_s]) for wait in waits]
    afters += workers.map("costs", answered, [(case,) for case in cases])
    return [
        Saving(
            case.what,
            case.cost,
            {
                task: difference(base[task], after[task], fewer=case.fewer)
                for task in base
                if task in after
            },
        )
        for case, after in zip([*waits, *cases], afters, strict=True)
    ]


def section(measured: Measured) -> Section:
    """A row for each change."""
    rows: list[Row] = []
    for row in measured.costs:
        cells: Row = {"what": row.what}
        for task in measured.y:
            gain = row.tasks.get(task)
            cells[f"{task}, points"] = (
                "" if gain is None else "{:+.0f} ({:+.0f} to {:+.0f})".format(*gain)
            )
        rows.append(cells | {"what it saves": row.cost})
    text = (
        f"Every row changes one thing of the quick choice at {WINDOW_S:g} s and chooses again. "
        "Points are percents of the decisions that become right, less those that become wrong, on "
        "the same trials left out; in brackets the 95 % interval of this difference. A larger "
        "taxel carries the sum of the forces on its area."
    )
    title = "What each saving costs, in points of accuracy"
    return Section("What each saving costs", [text], [Table("costs", title, rows, narrow=3)])


def formats(measured: Measured) -> Section | None:
    """The number formats of the graph that ships, side by side."""
    if not measured.formats:
        return None
    return Section(
        "The number format",
        [
            "The same graph in other number formats, by python -m export.arithmetic on this "
            "machine. The last column counts decisions on the model's golden vectors that name "
            "another label than the shipped graph. Only that graph gives the same bits everywhere."
        ],
        [
            Table(
                "formats",
                "Number formats",
                [dict(row) for row in measured.formats],
                timed=("decision us",),
            )
        ],
    )
