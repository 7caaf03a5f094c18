"""Other hardware and features: nested accuracy and time of every setting, and the Pareto front."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import matplotlib as mpl
import numpy as np
from numpy.typing import NDArray

from edge.touch.contact import FeatureSeries
from edge.touch.feature_sets import SETS
from edge.touch.features import FEATURES, SAMPLES, widths
from edge.touch.layout import SkinLayout
from train.dataset import DataSet
from train.evaluate import Labels, Result, SearchGrid
from train.report import skins
from train.report.figures import BESIDE, STROKES, STYLE, canvas, png
from train.report.score import interval, nested
from train.report.section import Figure, Section, Table, counted
from train.report.work import Workers
from train.tradeoff.board import Board
from train.tradeoff.measured import Measured, MeasuredPoint
from train.tradeoff.wires import Wire, wires

WINDOWS = (0.2, 0.4, 0.6, 0.8, 1.0, 1.2)
FEWER = (("max_force",), ("max_force", "contact_area"))
CONTACT = SETS["contact"]
COMPONENTS = (1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 17, 20)
"""Numbers of components to choose from."""
NEIGHBOURS = 6
"""Most neighbours to choose from."""


def pareto_front(points: Sequence[MeasuredPoint]) -> list[MeasuredPoint]:
    """The points that no other beats in both time and accuracy, the fastest first."""
    best: list[MeasuredPoint] = []
    for point in sorted(points, key=lambda p: (p.seconds, -p.result.accuracy)):
        if not best or point.result.accuracy > best[-1].result.accuracy:
            best.append(point)
    return best


def fronts(points: Sequence[MeasuredPoint], main: str, board: str, digest: str) -> dict[str, Any]:
    """The contents of front.json: the best settings on the recordings' own skin, to export with."""
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
            for point in pareto_front([p for p in points if p.task == main and p.own_skin])
        ],
    }


@dataclass(frozen=True)
class _Case:
    """A setting without its wire: skin, what is measured, and every how many frames arrive."""

    skin: str
    features: tuple[str, ...]
    scaling: str
    window_s: float
    every: int


def searched(
    X: NDArray[np.float64],
    y: Labels,
    scaling: str,
    features: Sequence[str],
    columns: Sequence[int] | None = None,
) -> dict[str, Result]:
    """Each task's nested accuracy, in ten folds.

    More features than the paper's are projected on discriminants, otherwise on principal
    components.
    """
    kind = "lda" if len(features) > len(FEATURES) else "pca"
    k = tuple(range(1, NEIGHBOURS + 1))
    grid = SearchGrid(scaling, kind, components=COMPONENTS, neighbours=k)
    return nested(X, y, grid, features, widths=columns)


def measure(dataset: DataSet, board: Board, workers: Workers) -> list[MeasuredPoint]:
    """Every setting worth showing, of every task."""
    recordings = [trial.recording for trial in dataset.trials]
    rate = float(np.median([1.0 / np.median(np.diff(r.t)) for r in recordings]))
    name = f"{dataset.layout.rows} x {dataset.layout.cols}"
    own = name
    series: dict[str, list[FeatureSeries | None]] = {name: [t.series for t in dataset.trials]}
    layouts: dict[str, SkinLayout] = {name: dataset.layout}
    while layouts[name].rows * layouts[name].cols > 1:
        coarse = skins.pooled_layout(layouts[name])
        recordings = [skins.pooled(r, coarse, np.add) for r in recordings]
        name = f"{coarse.rows} x {coarse.cols}"
        layouts[name] = coarse
        series[name] = skins.follow(
            recordings, coarse, dataset.tracking, dataset.chain, FEATURES, WINDOWS[-1]
        )
    wired = {name: wires(layout) for name, layout in layouts.items()}
    cases: list[_Case] = []
    for name in layouts:
        sets: list[tuple[tuple[str, ...], str]] = [(FEATURES, "IV")]
        if name == own:
            sets += [(CONTACT, "IV"), (FEATURES, "none"), *((few, "IV") for few in FEWER)]
        for every in sorted({wire.every(rate) for wire in wired[name]}):
            for features, scaling in sets if every == 1 else sets[:1]:
                cases += [_Case(name, features, scaling, window, every) for window in WINDOWS]
    y = {task: dataset.labels(task) for task in dataset.tasks}
    work = []
    for case in cases:
        columns = widths(case.features, SAMPLES, layouts[case.skin])
        thin = [s and s.thinned(case.every) for s in series[case.skin]]
        X = skins.vectors(thin, case.window_s, SAMPLES, case.features)
        work.append((X, y, case.scaling, case.features, columns))
    results = workers.map("settings", searched, work)
    return [
        MeasuredPoint(
            task=task,
            taxels=layouts[case.skin].rows * layouts[case.skin].cols,
            wire=wire.name,
            features=case.features,
            scaling=case.scaling,
            components=result.components,
            k=result.k,
            window_s=case.window_s,
            wire_s=_wire_s(wire, rate),
            arithmetic_s=board.arithmetic_s(len(case.features)),
            result=result,
            own_skin=case.skin == own,
        )
        for case, tasks in zip(cases, results, strict=True)
        for wire in wired[case.skin]
        if wire.every(rate) == case.every
        for task, result in tasks.items()
    ]


def _wire_s(wire: Wire, rate_hz: float) -> float:
    """On average half a period until the next frame, then that frame's time on the wire."""
    return 0.5 * wire.every(rate_hz) / rate_hz + wire.frame_s


def section(measured: Measured) -> Section:
    """Every setting, and those of the main task that no other beats."""
    points, main = measured.points, measured.main
    best = {task: pareto_front([p for p in points if p.task == task]) for task in measured.y}
    every, few = [], []
    for point in sorted(points, key=lambda p: (p.task != main, p.task, p.seconds)):
        front = point in best[point.task]
        low, high = point.result.interval
        row = {
            "task": point.task,
            "time ms": round(1e3 * point.seconds, 1),
            "accuracy %": round(100 * point.result.accuracy, 2),
            "95 % interval": interval(point.result),
            "taxels": point.taxels,
            "wire": point.wire,
            "features": _named(point.features),
            "scaling": point.scaling,
        }
        split = {
            "window ms": round(1e3 * point.window_s, 1),
            "wire ms": round(1e3 * point.wire_s, 2),
            "arithmetic ms": round(1e3 * point.arithmetic_s, 3),
        }
        paper = {"paper's point": "yes" if point.paper else ""}
        every.append(
            row
            | {"components": point.components, "k": point.k, **split}
            | {"low %": round(100 * low, 1), "high %": round(100 * high, 1)}
            | {"front": "yes" if front else "", **paper}
        )
        if point.task == main and (front or point.paper):
            few.append(row | split | paper)
    arithmetic, wire = (
        100 * max(part / p.seconds for p, part in pairs)
        for pairs in ([(p, p.arithmetic_s) for p in points], [(p, p.wire_s) for p in points])
    )
    title = f"The best settings of {main}, and the paper's"
    picture = _picture([p for p in points if p.task == main], best[main], main, measured.breakaways)
    return Section(
        "Every setting: skins, wires, features",
        [
            "The same contacts, read through other hardware. A larger taxel carries the sum of "
            "the forces on its area; a slower wire brings only every second, third, ... frame. The "
            "first table lists the settings that no other beats in both speed and accuracy. The "
            "best of many settings flatters: where intervals overlap, the cheaper setting may be "
            "as good.",
            f"Arithmetic on {measured.board.name} takes at most {arithmetic:.2g} % of a setting's "
            f"time, the wire at most {wire:.2g} %.",
            *_single_taxel(list(best), points),
        ],
        [
            Table("front", title, few, narrow=5, wide=12),
            Table("points", "Every point", every),
        ],
        [Figure("settings", f"Accuracy against time, every setting: {main}", picture)],
    )


def _named(features: Sequence[str]) -> str:
    """The name of the set that holds just these features, or their own names."""
    sets = (name for name, names in SETS.items() if names == tuple(features))
    return next(sets, " ".join(features))


def _single_taxel(tasks: Sequence[str], points: Sequence[MeasuredPoint]) -> list[str]:
    """A paragraph on the tasks for which one taxel does better than the skin, if any."""
    better = []
    for task in tasks:
        plain = [p for p in points if p.task == task and p.features == FEATURES]
        single = [100 * p.result.accuracy for p in plain if p.taxels == 1 and not p.own_skin]
        skin = max(100 * p.result.accuracy for p in plain if p.own_skin)
        if single and max(single) > skin:
            better.append(f"{max(single):.1f} % of {task}, where the skin reaches {skin:.1f} %")
    if not better:
        return []
    return [
        f"With the paper's three features a single taxel reaches {'; '.join(better)}. It reads the "
        "total force, and its motion is that of the arm: these show whether an object gives way. "
        "On a finer skin, the largest region leaves out the force on other regions, and its "
        "largest taxel depends on how the object lies on the grid. Features of the total force "
        "(`contact`) give the full skin the same advantage."
    ]


def _picture(
    points: Sequence[MeasuredPoint],
    best: Sequence[MeasuredPoint],
    task: str,
    breakaways: Mapping[str, float],
) -> bytes:
    """Accuracy against time, with the Pareto front and the paper's setting."""
    with mpl.rc_context(STYLE):
        figure = canvas(9.0, 5.0)
        axes: Any = figure.subplots()
        for i, taxels in enumerate(sorted({point.taxels for point in points}, reverse=True)):
            own = [p for p in points if p.taxels == taxels]
            x, y = _places(own)
            colour, marker, _ = STROKES[i % len(STROKES)]
            style = {"s": 16, "alpha": 0.55, "linewidths": 0, "color": colour, "marker": marker}
            axes.scatter(x, y, **style, label=counted(taxels, "taxel"))
        x, y = _places(best)
        ends = np.array([p.result.interval for p in best]).T * 100
        axes.errorbar(
            x, y, yerr=np.maximum([y - ends[0], ends[1] - y], 0.0), color="black", lw=1.2,
            elinewidth=0.7, capsize=2, marker="o", ms=5, mfc="white", drawstyle="steps-post",
            label="best settings, 95 %",
        )  # fmt: skip
        axes.plot(
            *_places([p for p in points if p.paper]), "*", ms=14, color="#e0a400", mec="black",
            mew=0.7, label="the paper's setting",
        )  # fmt: skip
        if breakaways:
            axes.plot(
                [1e3 * s for s in breakaways.values()], [0.022] * len(breakaways), "|", ms=11,
                color="#444444", transform=axes.get_xaxis_transform(),
                label="static friction\nbreaks, an object each",
            )  # fmt: skip
        axes.set_xlim(0, 1.04e3 * max(p.seconds for p in points))
        axes.set(xlabel="milliseconds from onset to decision", ylabel="nested accuracy, %")
        axes.set_title(f"Accuracy against time: {task}")
        axes.legend(**BESIDE)
        return png(figure)


def _places(points: Sequence[MeasuredPoint]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Milliseconds and percent of each point."""
    seconds = np.array([point.seconds for point in points])
    return 1e3 * seconds, 100 * np.array([point.result.accuracy for point in points])
