"""Questions that the paper did not ask: nested search, objects not met, baselines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from edge.touch.features import FEATURES
from train.crossval import MAX_COMPONENTS, MAX_K
from train.evaluate import FOLDS, Labels, Result, SearchGrid, group_folds
from train.report import figures
from train.report.score import grid_search, majority, percent, score
from train.report.score import nested as nested_search
from train.report.section import Figure, Section, Table
from train.study.context import Context

TABLE = "honest"
SEARCHED = "leave-one-out, best of the grid"
NESTED, UNSEEN, MAJORITY = "nested", "objects not met before", "majority"
GROUP_TASK = "object"


def section(context: Context) -> Section:
    """Nested accuracy, objects left out, and baselines."""
    X, y = context.vectors(), context.labels
    others: Labels = {task: labels for task, labels in y.items() if task != GROUP_TASK}
    results = {SEARCHED: grid_search(X, y), NESTED: _nested(context, X, y, NESTED)}
    if GROUP_TASK in y and others:
        folds = group_folds(y[GROUP_TASK])
        results[UNSEEN] = _nested(context, X, others, "objects not met", folds)
    results[MAJORITY] = {task: majority(labels) for task, labels in y.items()}
    text = [
        f"Nested: for each of {FOLDS} folds, components and k are chosen on the other folds, by "
        "models that see neither the fold nor their own test trials. The plain search flatters by: "
        + _costs(results, NESTED, list(y))
    ]
    if UNSEEN in results:
        text.append(
            "The paper's claim is about objects that the robot has not met. Plain leave-one-out "
            "keeps the other trials of the same object in training. Leaving out the whole object, "
            "its fixed and movable trials together, costs: " + _costs(results, UNSEEN, list(others))
        )
    png = figures.bars(
        list(results),
        {task: [tasks.get(task) for tasks in results.values()] for task in y},
        title="How the score is taken",
    )
    return Section(
        "Questions that the paper did not ask",
        text,
        [
            Table(
                TABLE,
                "How the score is taken",
                [
                    {"task": task, "how": how, **score(result)}
                    for how, tasks in results.items()
                    for task, result in tasks.items()
                ],
            ),
        ],
        [Figure("honest", "How the score is taken", png)],
        numbers={
            (TABLE, how, task): percent(result.accuracy)
            for how, tasks in results.items()
            for task, result in tasks.items()
        },
    )


def _nested(
    context: Context,
    X: NDArray[np.float64],
    y: Labels,
    what: str,
    folds: NDArray[np.int64] | None = None,
) -> dict[str, Result]:
    """Nested accuracy over the paper's grid: up to 20 components and neighbours."""
    grid = SearchGrid(
        components=tuple(range(1, MAX_COMPONENTS + 1)), neighbours=tuple(range(1, MAX_K + 1))
    )
    jobs, progress = context.workers.jobs, f"{what:<22}"
    return nested_search(X, y, grid, FEATURES, folds=folds, jobs=jobs, progress=progress)


def _costs(results: dict[str, dict[str, Result]], how: str, tasks: Sequence[str]) -> str:
    gaps = {t: results[SEARCHED][t].accuracy - results[how][t].accuracy for t in tasks}
    return ", ".join(f"{task} {100 * gap:+.1f} points" for task, gap in gaps.items()) + "."
