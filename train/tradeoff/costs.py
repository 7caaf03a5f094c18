"""What each thing that an owner can pay costs and gives, in one table."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from edge.recording import Recording
from edge.touch.features import WINDOW_S
from train.choose import Chosen
from train.dataset import DataSet, Recordings
from train.evaluate import Result, stratified_folds
from train.report.score import paired, points
from train.report.section import Row, Section, Table, counted
from train.report.skins import coarser
from train.report.work import Workers
from train.stopping import finest
from train.tradeoff.board import ESTIMATED, estimated_s
from train.tradeoff.choices import Points, chosen, followed, trials_of
from train.tradeoff.measured import Measured, Saving
from train.tradeoff.wires import Wire, wires

WAITS_S = (0.8, 0.6, 0.4)
EVERY = (2, 4)
"""Every n-th frame is read, for each n."""
PARTS = (2, 4)
"""One n-th of the trials is kept, for each n."""
FEWEST = 20
"""Trials below which no choice is made."""
TIME = "time on this machine"
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


def changes(raw: Recordings, dataset: DataSet) -> list[Change]:
    """Every change that is trained anew; windows are measured anyway."""
    rate = float(np.median([1.0 / np.median(np.diff(r.t)) for r in raw.recordings]))
    # The longest first: it runs beside the others.
    cases = [
        Change("all candidates (`make export`)", "longer training", raw, given={"quick": False})
    ]
    for n in EVERY:
        carried = [w.name for w in wires(dataset.layout) if w.every(rate) == n]
        cost = f"{carried[0]} are enough" if carried else f"1/{n} of the bits on the wire"
        source = replace(raw, recordings=tuple(every_nth(r, n) for r in raw.recordings))
        cases.append(Change(f"{rate / n:.0f} frames a second", cost, source))
    full = _slowest(wires(dataset.layout))
    for skin, recordings in coarser(dataset.layout, raw.recordings):
        saved = 1e3 * (full.frame_s - _slowest(wires(skin)).frame_s)
        cost = f"a frame is {saved:.1f} ms shorter on 1 bus of AD7147"
        what = counted(skin.rows * skin.cols, "taxel")
        cases.append(Change(what, cost, replace(raw, recordings=tuple(recordings))))
    cases.append(
        Change("the paper's features", "only 3 features", dataset, given={"features": ["paper"]})
    )
    y = {task: dataset.labels(task) for task in dataset.tasks}
    for part in PARTS:
        rows = np.flatnonzero(stratified_folds(y[finest(y)], part) == 0)
        if len(rows) >= FEWEST:
            what = f"{len(rows)} of {len(dataset.trials)} trials"
            cost = f"{counted(len(dataset.trials) - len(rows), 'recording')} fewer"
            cases.append(Change(what, cost, trials_of(dataset, rows), fewer=True))
    return cases


def _slowest(choices: Sequence[Wire]) -> Wire:
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


def answered(change: Change) -> tuple[dict[str, Hits], float]:
    """{task: the answers of the choice with a change}, and the seconds of one core it took."""
    began = time.process_time()
    source, quick = change.source, change.given.get("quick", True)
    dataset = source if isinstance(source, DataSet) else followed(source, quick=quick)
    made = chosen(dataset, change.window_s, **change.given)
    answers = {task: hits(dataset, choice.by_trial) for task, choice in made.items()}
    return answers, time.process_time() - began


def difference(before: Hits, after: Hits, *, fewer: bool) -> tuple[float, float, float]:
    """The points gained by a change, and their 95 % interval, on the same trials."""
    trials = list(after if fewer else before)
    return paired(
        np.array([before[trial] for trial in trials]),
        np.array([after.get(trial, False) for trial in trials]),
    )


def measure(raw: Recordings, dataset: DataSet, windows: Points, workers: Workers) -> list[Saving]:
    """Every change beside the choice at `WINDOW_S` on the recordings as they are."""

    def of(tasks: Mapping[str, Chosen]) -> dict[str, Hits]:
        return {task: hits(dataset, choice.by_trial) for task, choice in tasks.items()}

    base = of(windows[WINDOW_S])
    waits = [
        Change(f"waiting {w:g} s", f"{WINDOW_S - w:.1f} s sooner", dataset, w) for w in WAITS_S
    ]
    cases = changes(raw, dataset)
    afters = [(of(windows[wait.window_s]), 0.0) for wait in waits]
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
            seconds,
        )
        for case, (after, seconds) in zip([*waits, *cases], afters, strict=True)
    ]


def section(measured: Measured) -> Section:
    """A row for each change, number format and board."""
    rows = [
        _row(measured, saving.what, saving.cost, _training(saving.choice_s))
        | {f"{task}, points": points(gain) for task, gain in saving.tasks.items()}
        for saving in measured.costs
    ]
    rows += [
        _row(
            measured,
            str(row["format"]),
            f"{row['size kB']:.0f} kB; {row['other labels %']:.1f} % of the labels differ; "
            f"{row['other distances alone %']:.0f} % of the distances depend on the batch",
            f"{row['decision us']:.0f} us to decide",
        )
        for row in measured.formats
    ]
    rows += [
        _row(measured, f"deciding on a {board}", f"about {1e3 * estimated_s(board):.1f} ms")
        | dict.fromkeys((f"{task}, points" for task in measured.y), "the same bits")
        for board in ESTIMATED
    ]
    return Section(
        "What each thing costs and gives",
        [
            f"Every row changes one thing of the quick choice at {WINDOW_S:g} s and chooses again, "
            "with the features that it then takes. Points are percents of the decisions that "
            "become right, less those that become wrong, on the same trials left out; in brackets "
            "stands the 95 % interval of this difference. A larger taxel carries the sum of the "
            "forces on its area.",
            "Number formats are those of the graph that ships, by `python -m export.arithmetic` on "
            "this machine. The labels that differ are counted on the model's golden vectors. A "
            "distance depends on the batch where it has other bits if its vector is decided alone: "
            "only whole numbers give the same bits in any order of summation, and so on every "
            "machine. A board's time is an estimate, see the section on the board.",
        ],
        [Table("costs", "Points of accuracy, and the price", rows, timed=(TIME,), narrow=3)],
    )


def _training(seconds: float) -> str:
    return f"{seconds:.1f} s to train" if seconds else ""


def _row(measured: Measured, what: str, price: str, time: str = "") -> Row:
    tasks = [f"{task}, points" for task in measured.y]
    cells: Row = {"what": what, tasks[0]: "", "price": price}
    return cells | dict.fromkeys(tasks[1:], "") | {TIME: time}
