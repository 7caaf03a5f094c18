"""The trade-off: recordings and a board's figures in; report and settings out."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from edge.errors import InputError
from edge.files import write_whole
from edge.touch.feature_sets import SETS, expand
from edge.touch.features import FEATURES, SAMPLES
from train.dataset import load_trials
from train.evaluate import SearchGrid
from train.report.page import write
from train.report.section import Section, counted
from train.report.work import Workers
from train.simulate import scene as scenes
from train.stopping import finest
from train.tradeoff import answer, arithmetic, early, prices, settings, stopping
from train.tradeoff import board as boards
from train.tradeoff.breakaway import breakaway_times
from train.tradeoff.measured import Measured

SECTIONS: tuple[Callable[[Measured], Section | None], ...] = (
    answer.section,
    answer.reasons,
    stopping.section,
    settings.section,
    arithmetic.section,
    stopping.unknown,
    arithmetic.sizes,
    arithmetic.board,
    answer.glossary,
)
"""The report's sections in their order; None where there is nothing to show."""
DECISION_POINTS_S = tuple(round(0.1 * i, 1) for i in range(2, 13))
FEWEST = 40
NAMES = expand(["paper", "contact"])
GRIDS = (SearchGrid("IV", features=FEATURES), SearchGrid("IV", "lda", features=SETS["contact"]))
"""Candidates for every task's decision: the paper's way, and the discriminants of `contact`."""


def tradeoff(
    data: Sequence[str],
    out: Path,
    board_path: str,
    *,
    scene_path: str | None = None,
    jobs: int = 1,
    main: str | None = None,
    prices_path: str | None = None,
) -> Path:
    """Measure every setting worth showing and write the report; its path.

    Args:
        data: recordings and folders of them.
        out: folder of the report.
        board_path: board.json of a model that was fitted on these recordings.
        scene_path: the scene that they were simulated from, for the physical limit.
        jobs: processes.
        main: the task of the settings' picture and of front.json; `category` where there is one.
        prices_path: prices.json of these recordings, for the price of a model's size.

    Raises:
        InputError: the data cannot be used, or a file is of another kind or of other recordings.
    """
    board = boards.read(board_path)
    scene = None if scene_path is None else scenes.load(scene_path)
    horizon_s = max(settings.WINDOWS[-1], DECISION_POINTS_S[-1])
    dataset = load_trials(data, horizon_s=horizon_s, features=NAMES, progress=True)
    boards.check(board, board_path, dataset.digest)
    sizes = None if prices_path is None else prices.read(prices_path, dataset.digest)
    if len(dataset.trials) < FEWEST:
        raise InputError(f"a trade-off needs at least {FEWEST} trials, not {len(dataset.trials)}")
    if main is None:
        main = "category" if "category" in dataset.tasks else dataset.tasks[0]
    if main not in dataset.tasks:
        raise InputError(f"--task must be one of {', '.join(dataset.tasks)}, not {main!r}")
    order = sorted(dataset.tasks, key=lambda task: (task != main, task))
    y = {task: dataset.labels(task) for task in order}
    X = np.stack([dataset.features(window, SAMPLES, NAMES) for window in DECISION_POINTS_S])
    names, columns = dataset.names, dataset.widths(SAMPLES)
    choose = early.Chooser(X[-1], y, GRIDS, names, columns)
    compared = early.compare_stopping(
        X, y, DECISION_POINTS_S, names, choose, widths=columns, jobs=jobs
    )
    choices, most = choose(np.arange(X.shape[1])).choices, finest(y)
    measured = Measured(
        dataset=dataset,
        y=y,
        main=main,
        board=board,
        prices=sizes,
        breakaways={} if scene is None else breakaway_times(scene),
        comparisons=compared,
        choices=choices,
        novelty=early.novelty(X[-1], y[most], choices[most], names, columns),
        points=settings.measure(dataset, board, Workers(jobs)),
    )
    simulated = "" if scene is None else f" that were simulated ({scene.name})"
    lead = [
        "How long must a robot wait before it knows what its arm has touched, and what does each "
        f"answer cost? Measured on {counted(len(dataset.trials), 'contact')}{simulated}."
    ]
    sections = [section for make in SECTIONS if (section := make(measured)) is not None]
    report = write(out, "What accuracy costs in time", lead, sections)
    front = settings.fronts(measured.points, main, board.name, dataset.digest)
    with write_whole(out / "front.json") as file:
        file.write(json.dumps(front, indent=1).encode() + b"\n")
    return report
