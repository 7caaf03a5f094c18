"""The trade-off: its report and settings, from recordings and the figures of a
board."""

import json
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from edge.errors import InputError, counted
from edge.record.recording import Recording
from edge.writing import write_whole
from train.data.dataset import DataSet, read
from train.report.page import write
from train.report.section import Section
from train.report.work import Workers
from train.tradeoff import answer, costs, early
from train.tradeoff import board as boards
from train.tradeoff.choices import WINDOWS_S, chosen, prepared
from train.tradeoff.commands import Commands
from train.tradeoff.front import ParetoFront
from train.tradeoff.measured import Measurements

SECTIONS: tuple[Callable[[Measurements], Section], ...] = (
    answer.section,
    costs.section,
    answer.reasons,
    lambda measurements: boards.section(measurements.board),
    lambda measurements: Section("Terms", terms=answer.GLOSSARY),
)
"""The report's sections, in its order."""
FEWEST = 40
"""Smallest number of trials."""


def require_enough(trials: int) -> None:
    """Refuse too few trials.

    Raises:
        InputError: they are fewer than `FEWEST`.
    """
    if trials < FEWEST:
        raise InputError(
            f"a trade-off needs at least {FEWEST} trials, not {trials}; record more"
        )


def tradeoff(
    data: Sequence[str],
    out: Path,
    board_path: str,
    *,
    task: str | None = None,
    quick: bool = False,
    jobs: int = 1,
) -> Path:
    """Measure the choice at each window and with each change, and write the report.

    Args:
        data: recordings and folders of them.
        out: folder of the report.
        board_path: board.json of a model that was fitted on these recordings.
        task: of front.json; by default `category`, or else the first.
        quick: make quick choices.
        jobs: processes.

    Returns:
        The path of report.html.

    Raises:
        InputError: the data cannot be used, or a file is of another kind or of other
            recordings.
    """
    workers = Workers(jobs)
    board = boards.read(board_path)
    raw = read(data, progress=True)
    boards.check(board, board_path, raw.digest)
    ready = prepared(raw, quick=quick, jobs=jobs)
    dataset = ready.dataset
    require_enough(len(dataset.trials))
    main = _main_task(dataset, task)
    cases = [(dataset, window_s) for window_s in ready.windows]
    choices = workers.map("windows", partial(chosen, quick=quick), cases)
    points = dict(zip(ready.windows, choices, strict=True))
    rate = _rate_hz(raw.recordings)
    certified = early.certified(dataset, WINDOWS_S, quick=quick, jobs=jobs)
    rows = costs.measure(raw, dataset, points, rate, workers)
    order = sorted(dataset.tasks, key=lambda task: (task != main, task))
    measurements = Measurements(
        y={task: dataset.labels(task) for task in order},
        board=board,
        wire_s=_wire_time_s(raw.recordings, rate),
        points=points,
        certified=certified,
        costs=rows,
        commands=Commands(
            data=tuple(map(str, data)),
            touch=raw.paths[0],
            out=out,
            quick=quick,
        ),
        notes=ready.notes,
    )
    report = _write(measurements, out, counted(len(dataset.trials), "contact"))
    front = ParetoFront.of(points, main, quick=quick)
    text = json.dumps(front.to_dict(dataset.digest), indent=1)
    with write_whole(out / "front.json") as file:
        file.write(text.encode() + b"\n")
    return report


def _rate_hz(recordings: Sequence[Recording]) -> float:
    """Frames a second, as a median over the recordings whose time goes on."""
    steps_s = [np.median(np.diff(r.t)) for r in recordings if len(r.t) > 1]
    return float(np.median([1.0 / step_s for step_s in steps_s if step_s > 0.0]))


def _wire_time_s(recordings: Sequence[Recording], rate_hz: float) -> float | None:
    """Seconds from the end of a window until its last frame is read: half a frame's
    period until it begins, and its time on the skin's wires, where
    `edge-classify record` stored that (`meta.wire_s`)."""
    stored = [recording.meta.get("wire_s") for recording in recordings]
    times = [wire_s for wire_s in stored if isinstance(wire_s, int | float)]
    return 0.5 / rate_hz + max(times) if times else None


def _main_task(dataset: DataSet, task: str | None) -> str:
    """The task of front.json.

    Raises:
        InputError: the recordings have no labels for it.
    """
    main = task or ("category" if "category" in dataset.tasks else dataset.tasks[0])
    if main not in dataset.tasks:
        raise InputError(
            f"--task must be one of {', '.join(dataset.tasks)}, not {main!r}"
        )
    return main


def _write(measurements: Measurements, out: Path, contacts: str) -> Path:
    """Write the report on so many contacts."""
    lead = [
        "How long must a robot wait before it knows what its arm has touched? This "
        "report measures the accuracy after each time, and the cost of each way to "
        f"save. It is based on {contacts}."
    ]
    sections = [make(measurements) for make in SECTIONS]
    return write(out, "Accuracy against time", lead, sections)
