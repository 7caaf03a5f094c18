"""The trade-off: its report and settings, from recordings and the figures of a
board."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from edge.errors import InputError
from edge.files import write_whole
from train.dataset import read
from train.report.page import write
from train.report.section import Section, counted
from train.report.work import Workers
from train.simulate import scene as scenes
from train.tradeoff import answer, costs, early, shear
from train.tradeoff import board as boards
from train.tradeoff.breakaway import breakaway_times
from train.tradeoff.choices import WINDOWS_S, chosen, followed
from train.tradeoff.front import ParetoFront
from train.tradeoff.measured import Measured
from train.tradeoff.wires import waited_s

SECTIONS: tuple[Callable[[Measured], Section], ...] = (
    answer.section,
    costs.section,
    answer.prices,
    answer.reasons,
    answer.early,
    lambda measured: boards.section(measured.board),
    lambda measured: Section("Terms", terms=answer.GLOSSARY),
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
    scene_path: str | None = None,
    jobs: int = 1,
    main: str | None = None,
    wrong: float = 10.0,
    second: float = 1.0,
    formats_path: str | None = None,
) -> Path:
    """Measure the quick choice at each window and with each change, and write the
    report.

    Args:
        data: recordings and folders of them.
        out: folder of the report.
        board_path: board.json of a model that was fitted on these recordings.
        scene_path: the scene that the recordings were simulated from, for the physical
            limit.
        jobs: processes.
        main: the task of front.json; by default `category`, or else the first.
        wrong, second: an owner's price of a wrong decision, and of waiting for a
            second.
        formats_path: the file that `python -m export.arithmetic` wrote about that
            model.

    Returns:
        The path of report.html.

    Raises:
        InputError: the data cannot be used, or a file is of another kind or of other
            recordings.
    """
    board = boards.read(board_path)
    formats = [] if formats_path is None else boards.read_formats(formats_path)
    scene = None if scene_path is None else scenes.load(scene_path)
    raw = read(data, progress=True)
    boards.check(board, board_path, raw.digest)
    dataset = followed(raw, progress=True)
    require_enough(len(dataset.trials))
    main = main or ("category" if "category" in dataset.tasks else dataset.tasks[0])
    if main not in dataset.tasks:
        raise InputError(
            f"--task must be one of {', '.join(dataset.tasks)}, not {main!r}"
        )
    order = sorted(dataset.tasks, key=lambda task: (task != main, task))
    y = {task: dataset.labels(task) for task in order}
    workers = Workers(jobs)
    made = workers.map("windows", chosen, [(dataset, window) for window in WINDOWS_S])
    points = dict(zip(WINDOWS_S, made, strict=True))
    rate = float(np.median([1.0 / np.median(np.diff(r.t)) for r in raw.recordings]))
    comparisons = early.compare_stopping(dataset, WINDOWS_S, jobs=jobs)
    sheared = None
    if dataset.layout.axes:
        measured_with = shear.Answers(points, comparisons)
        sheared = shear.compared(dataset, measured_with, workers)
    measured = Measured(
        y=y,
        board=board,
        wire_s=waited_s(dataset.layout, rate),
        breakaways={} if scene is None else breakaway_times(scene),
        points=points,
        comparisons=comparisons,
        costs=costs.measure(raw, dataset, points, rate, workers),
        wrong=wrong,
        second=second,
        formats=formats,
        shear=sheared,
    )
    simulated = "" if scene is None else f", simulated from the scene {scene.name}"
    lead = [
        "How long must a robot wait before it knows what its arm has touched? This "
        "report measures "
        "the accuracy after each time, and the cost of each way to save. It is based "
        "on "
        f"{counted(len(dataset.trials), 'contact')}{simulated}."
    ]
    sections = [make(measured) for make in SECTIONS]
    if sheared is not None:
        sections.insert(1, shear.section(sheared))
    report = write(out, "Accuracy against time", lead, sections)
    best = ParetoFront.of(points, main, measured.after_s).to_dict(dataset.digest)
    with write_whole(out / "front.json") as file:
        file.write(json.dumps(best, indent=1).encode() + b"\n")
    return report
