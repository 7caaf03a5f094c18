"""The whole trade-off: recordings and a board's figures in; picture, tables and settings out."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from tqdm import tqdm

from edge.errors import InputError
from edge.files import write_whole
from edge.touch.contact import FeatureSeries
from edge.touch.feature_sets import SETS, expand
from edge.touch.features import FEATURES, SAMPLES, feature_vector, widths
from edge.touch.layout import SkinLayout
from train.dataset import DataSet, load_trials
from train.evaluate import Labels, SearchGrid
from train.pipeline import Choice
from train.report.html import write
from train.simulate import scene as scenes
from train.stopping import finest
from train.study import skins
from train.tradeoff import answer, arithmetic, early, prices, sections
from train.tradeoff import board as boards
from train.tradeoff.accuracy import Chooser, MeasuredPoint, nested, pareto_front
from train.tradeoff.wires import Wire, wires

WINDOWS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
DECISION_POINTS_S = tuple(round(0.1 * i, 1) for i in range(2, 13))
FEWER = (("max_force",), ("max_force", "contact_area"))
PAPER = ("none", 1.2)
"""The paper's operating point: no scaling, 1.2 s, its three features, all taxels (IV-A)."""
FEWEST = 40
CONTACT = SETS["contact"]
NAMES = expand(["paper", "contact"])
GRIDS = (SearchGrid("IV", features=FEATURES), SearchGrid("IV", "lda", features=CONTACT))
"""Candidates for every task's decision: the paper's way, and the discriminants of `contact`."""
Case = tuple[str, int, tuple[str, ...], str, float, int]
"""Skin's name, taxels, features, scaling, window, and n where only every n-th frame arrives."""


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
        out: folder.
        board_path: board.json of a model that was fitted on these recordings.
        scene_path: what they were simulated from, for the physical floor.
        jobs: processes.
        main: the task of the picture and of front.json; `category` where there is one.
        prices_path: prices.json of these recordings, for the price of a model's size.

    Raises:
        InputError: the data cannot be used, or the board file is none or another model's.
    """
    board = boards.read(board_path)
    scene = None if scene_path is None else scenes.load(scene_path)
    dataset = load_trials(data, horizon_s=WINDOWS[-1], features=NAMES, progress=True)
    boards.check(board, board_path, dataset.digest)
    sizes = None if prices_path is None else prices.read(prices_path, dataset.digest)
    if len(dataset.trials) < FEWEST:
        raise InputError(f"a trade-off needs at least {FEWEST} trials, not {len(dataset.trials)}")
    if main is None:
        main = "category" if "category" in dataset.tasks else dataset.tasks[0]
    if main not in dataset.tasks:
        raise InputError(f"--task must be one of {', '.join(dataset.tasks)}, not {main!r}")
    y = {task: dataset.labels(task) for task in dataset.tasks}
    order = sorted(y, key=lambda task: (task != main, task))
    both, choice, strange = _early(dataset, {task: y[task] for task in order}, jobs)
    points = measured(dataset, board, jobs)
    best = {task: pareto_front([p for p in points if p.task == task]) for task in dataset.tasks}
    breakaways = {} if scene is None else early.breakaway_times(scene)
    fastest = next(point for point in points if is_paper(point))
    parts = [
        answer.section(both, y, fastest.wire_s, board, len(NAMES)),
        answer.reasons(fastest.wire_s, board, len(NAMES), breakaways),
        sections.stopping(both, breakaways, main, board),
        sections.operating_points(points, best, main, board, breakaways, is_paper),
        arithmetic.section(dataset, y[main], main, choice[main], board, sizes, points),
        *([sections.unknown(finest(y), strange)] if strange else []),
        *([] if sizes is None else [prices.section(sizes, dataset, main)]),
        sections.arithmetic(board),
        answer.glossary(),
    ]
    lead = [
        "How long must a robot wait before it knows what its arm has touched, and what does each "
        f"answer cost? Measured on {len(dataset.trials)} contacts"
        + ("." if scene is None else f" that were simulated ({scene.name})."),
    ]
    report = write(out, "What accuracy costs in time", lead, parts)
    with write_whole(out / "front.json") as file:
        file.write(
            json.dumps(fronts(points, main, board.name, dataset.digest), indent=1).encode() + b"\n"
        )
    return report


def measured(dataset: DataSet, board: boards.Board, jobs: int) -> list[MeasuredPoint]:
    """Every setting worth showing, of every task."""
    recordings = [trial.recording for trial in dataset.trials]
    rate = float(np.median([1.0 / np.median(np.diff(r.t)) for r in recordings]))
    layout = dataset.layout
    series: dict[str, list[FeatureSeries | None]] = {"": [t.series for t in dataset.trials]}
    layouts: dict[str, SkinLayout] = {"": layout}
    name = ""
    while layouts[name].rows * layouts[name].cols > 1:
        coarse = skins.pooled_layout(layouts[name])
        recordings = [skins.pooled(r, coarse, np.add) for r in recordings]
        name = f"{coarse.rows} x {coarse.cols}"
        layouts[name] = coarse
        series[name] = skins.follow(
            recordings, coarse, dataset.tracking, dataset.chain, FEATURES, WINDOWS[-1]
        )
    wired = {name: wires(each) for name, each in layouts.items()}
    cases: list[Case] = []
    for name, each in layouts.items():
        taxels = each.rows * each.cols
        sets: list[tuple[tuple[str, ...], str]] = [(FEATURES, "IV")]
        if not name:
            sets += [(CONTACT, "IV"), (FEATURES, "none"), *((few, "IV") for few in FEWER)]
        for every in sorted({wire.every(rate) for wire in wired[name]}):
            for features, scaling in sets if every == 1 else sets[:1]:
                cases += [(name, taxels, features, scaling, w, every) for w in WINDOWS]
    y = {task: dataset.labels(task) for task in dataset.tasks}
    work = (
        delayed(nested)(
            _vectors(series[case[0]], case, layouts[case[0]]),
            y,
            case[3],
            case[2],
            widths(case[2], SAMPLES, layouts[case[0]]),
        )
        for case in cases
    )
    results = Parallel(n_jobs=jobs, return_as="generator")(work)
    points: list[MeasuredPoint] = []
    for case, found in zip(cases, tqdm(results, total=len(cases), desc="settings"), strict=True):
        name, taxels, features, scaling, window, every = case
        for wire in wired[name]:
            if wire.every(rate) != every:
                continue
            for task, result in found.items():
                points.append(
                    MeasuredPoint(
                        task=task,
                        taxels=taxels,
                        wire=wire.name,
                        features=features,
                        scaling=scaling,
                        components=result.components,
                        k=result.k,
                        window_s=window,
                        wire_s=_wire_s(wire, rate),
                        arithmetic_s=board.arithmetic_s(len(features)),
                        result=result,
                        whole=not name,
                    )
                )
    return points


def _wire_s(wire: Wire, rate_hz: float) -> float:
    """On average half a period passes until the next frame, which then takes its time."""
    return 0.5 * wire.every(rate_hz) / rate_hz + wire.frame_s


def _vectors(
    series: Sequence[FeatureSeries | None], case: Case, layout: SkinLayout
) -> NDArray[np.float64]:
    _, _, features, _, window, every = case
    X = np.zeros((len(series), sum(widths(features, SAMPLES, layout))))
    for row, one in zip(X, series, strict=True):
        if one is not None:
            row[:] = feature_vector(one.thinned(every), window, SAMPLES, features)
    return X


def _early(
    dataset: DataSet, y: Labels, jobs: int
) -> tuple[dict[str, early.StoppingComparison], dict[str, Choice], list[early.NoveltyCount]]:
    """Early stopping of every task, what all trials choose, and objects left out whole."""
    X = np.stack([dataset.features(window, SAMPLES, NAMES) for window in DECISION_POINTS_S])
    columns = dataset.widths(SAMPLES)
    choose = Chooser(X[-1], y, GRIDS, dataset.names, columns)
    found = early.compare_stopping(
        X, y, DECISION_POINTS_S, dataset.names, choose, widths=columns, jobs=jobs
    )
    choices = choose(np.arange(X.shape[1])).choices
    most = finest(y)
    return found, choices, early.novelty(X[-1], y[most], choices[most], dataset.names, columns)


def is_paper(point: MeasuredPoint) -> bool:
    """The paper's setting, on the wire that carries its 100 frames a second."""
    return (
        point.whole
        and (point.scaling, point.window_s) == PAPER
        and point.features == FEATURES
        and point.wire.startswith("AD7147, 3")
    )


def fronts(points: Sequence[MeasuredPoint], main: str, board: str, digest: str) -> dict[str, Any]:
    """front.json: the best settings on the recordings' own skin, which models are exported for."""
    return {
        "format": 1,
        "task": main,
        "board": board,
        "data_digest": digest,
        "points": [
            {
                "window_s": point.window_s,
                "features": list(point.features),
                "scaling": point.scaling,
                "components": point.components,
                "k": point.k,
                "wire": point.wire,
                "milliseconds": round(1e3 * point.seconds, 2),
                "accuracy": round(point.result.accuracy, 4),
            }
            for point in pareto_front([p for p in points if p.task == main and p.whole])
        ],
    }
