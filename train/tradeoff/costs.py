"""The accuracy that each saving costs, in one table."""

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from edge.errors import counted
from edge.features.names import feature
from edge.features.vector import WINDOW_S
from edge.touch.layout import SkinLayout
from train.choose.settings import Chosen
from train.data.dataset import DataSet, Recordings
from train.data.folds import finest, stratified_folds
from train.data.parts import part
from train.report.score import paired, points
from train.report.section import ReportTable, Row, Section
from train.report.skins import coarser
from train.report.work import Workers
from train.tradeoff.choices import Points, chosen, followed
from train.tradeoff.measured import Measurements

WAITS_S = (0.8, 0.6, 0.4)
EVERY = (2, 4)
"""Every n-th frame is read, for each n."""
PARTS = (2, 4)
"""One n-th of the trials is kept, for each n."""
FEWEST = 20
"""Smallest number of trials for a choice."""
Hits = Mapping[tuple[Path, int], bool]
"""{(recording, number of its contact): whether the answer is right}."""


@dataclass(frozen=True)
class Saving:
    """A change, and the options of the choice made with it.

    Attributes:
        name: the change.
        price: its saving.
        source: the trials, or recordings to follow again.
        options: of the choice.
        fewer: whether trials are left out on purpose; otherwise a contact that is no
            longer noticed counts as wrong.
    """

    name: str
    price: str
    source: DataSet | Recordings
    options: Mapping[str, Any] = field(default_factory=dict)
    fewer: bool = False


def changes(raw: Recordings, dataset: DataSet, rate_hz: float) -> list[Saving]:
    """The changes for which a choice is made again; the shorter windows are measured
    anyway.

    Args:
        raw: the recordings.
        dataset: their trials.
        rate_hz: frames a second.
    """
    cases = list(_fewer_frames(raw, rate_hz))
    cases += _fewer_taxels(raw, dataset.layout)
    paper = {"features": ["paper"]}
    name = "the paper's features"
    cases.append(Saving(name, "only 3 features", dataset, options=paper))
    if dataset.layout.axes:
        taxels = dataset.layout.rows * dataset.layout.cols
        price = f"{4 * taxels} bytes a frame fewer"
        cases.append(Saving("no shear", price, without_shear(dataset)))
    return [*cases, *_fewer_trials(dataset)]


def _fewer_frames(raw: Recordings, rate_hz: float) -> Iterator[Saving]:
    """Every n-th frame."""
    for n in EVERY:
        price = f"1/{n} of the bits on the wire"
        thinned = [part(r, slice(None, None, n)) for r in raw.recordings]
        source = replace(raw, recordings=tuple(thinned))
        yield Saving(f"{rate_hz / n:.0f} frames a second", price, source)


def _fewer_taxels(raw: Recordings, layout: SkinLayout) -> Iterator[Saving]:
    """Larger taxels."""
    for skin, recordings in coarser(layout, raw.recordings):
        taxels = skin.rows * skin.cols
        price = f"{taxels} of {layout.rows * layout.cols} taxels to read"
        source = replace(raw, recordings=tuple(recordings))
        yield Saving(counted(taxels, "taxel"), price, source)


def without_shear(dataset: DataSet) -> DataSet:
    """The same trials without the features of shear."""
    names = [name for name in dataset.names if not feature(name).quantity.shear]
    return dataset.of(names)


def _fewer_trials(dataset: DataSet) -> Iterator[Saving]:
    """A part of the trials, as far as it suffices for a choice."""
    y = {task: dataset.labels(task) for task in dataset.tasks}
    count = len(dataset.trials)
    for folds in PARTS:
        sample = dataset.part(stratified_folds(y[finest(y)], folds) == 0)
        remaining = len(sample.trials)
        if remaining >= FEWEST:
            price = f"{counted(count - remaining, 'recording')} fewer"
            yield Saving(f"{remaining} of {count} trials", price, sample, fewer=True)


def hits(dataset: DataSet, choices: Mapping[str, Chosen]) -> dict[str, Hits]:
    """{task: {(recording, number of its contact): whether the answer is right}}."""
    contacts = []
    numbers = Counter[Path]()
    for trial in dataset.trials:
        contacts.append((trial.path, numbers[trial.path]))
        numbers[trial.path] += 1
    of_tasks: dict[str, Hits] = {}
    for task, choice in choices.items():
        right = np.asarray(choice.by_trial.hits).tolist()
        of_tasks[task] = dict(zip(contacts, right, strict=True))
    return of_tasks


def answered(change: Saving, like: SkinLayout) -> dict[str, Hits]:
    """{task: hits of the quick choice made with a change}.

    Args:
        change: to measure.
        like: the skin whose thresholds are taken.
    """
    dataset = change.source
    if not isinstance(dataset, DataSet):
        dataset = followed(dataset, like=like)
    return hits(dataset, chosen(dataset, **change.options))


def difference(before: Hits, after: Hits, *, fewer: bool) -> tuple[float, float, float]:
    """The percentage points gained by a change on the same trials, and their 95 %
    interval; see `Saving.fewer`."""
    trials = after if fewer else before
    were = [before[trial] for trial in trials]
    are = [after.get(trial, False) for trial in trials]
    return paired(np.array(were), np.array(are))


def measure(
    raw: Recordings,
    dataset: DataSet,
    windows: Points,
    rate_hz: float,
    workers: Workers,
) -> list[Row]:
    """A row for each change, beside the choice at `WINDOW_S` on the recordings as they
    are.

    Args:
        raw: the recordings.
        dataset: their trials.
        windows: the choices at each window; waiting is compared with these, and every
            other change with the quick choice.
        rate_hz: frames a second.
        workers: the processes.
    """
    full = hits(dataset, windows[WINDOW_S])
    rows = []
    for w in filter(windows.__contains__, WAITS_S):
        wait = Saving(f"waiting {w:g} s", f"{WINDOW_S - w:.1f} s sooner", dataset)
        rows.append(row_of(wait, full, hits(dataset, windows[w])))
    cases = changes(raw, dataset, rate_hz)
    unchanged = Saving("the quick choice", "", dataset)
    jobs = [(case, dataset.layout) for case in (unchanged, *cases)]
    base, *afters = workers.map("costs", answered, jobs)
    return rows + [
        row_of(case, base, after) for case, after in zip(cases, afters, strict=True)
    ]


def row_of(case: Saving, base: Mapping[str, Hits], after: Mapping[str, Hits]) -> Row:
    """The row of a change: the points that it gains, and what it saves."""
    gains = {
        f"{task}, points": points(difference(base[task], after[task], fewer=case.fewer))
        for task in base
        if task in after
    }
    return {"change": case.name, **gains, "saves": case.price}


def section(measurements: Measurements) -> Section:
    """A row for each change."""
    title = "Accuracy gained or lost by each change"
    return Section(
        "Savings, and the accuracy that they cost",
        [
            f"Each row changes one setting of the choice at {WINDOW_S:g} s: a shorter wait "
            "of the choice above, everything else of the quick choice, which is made "
            "again with the features that suit the change. A larger taxel reads the sum "
            "of the forces on its area. The last section explains points and intervals.",
        ],
        [ReportTable("costs", title, measurements.costs)],
    )
