"""Effect of taxel resolution (Table I, Fig. 9), by larger taxels and by fewer chips."""

from __future__ import annotations

from functools import partial

import numpy as np

from edge.touch.layout import SkinLayout
from train.report import figures
from train.report.tables import SCORE, Figure, Section, Table, percent, score
from train.study.classify import papers
from train.study.context import Context
from train.study.readings import BY_MEAN, averaged
from train.study.score import grid_search
from train.study.skins import View, masked, pooled_down, pooled_layout, thinned, vectors

HOW = {"sum": np.add, "maximum": np.maximum}
SHARES = (1, 2, 4, 8)


def layouts(layout: SkinLayout) -> list[SkinLayout]:
    """The skin, and 2 x 2 of its taxels as one again and again, down to one taxel."""
    found = [layout]
    while found[-1].rows * found[-1].cols > 1:
        found.append(pooled_layout(found[-1]))
    # As the paper, from 6 taxels to 1 in one step.
    return [skin for skin in found if not 1 < skin.rows * skin.cols < 4]


def coarser(layout: SkinLayout, how: str) -> list[View]:
    """The view by every skin of `layouts` but the first."""
    wanted = {skin.shape for skin in layouts(layout)[1:]}
    found: list[View] = []
    steps: list[SkinLayout] = []
    while layout.rows * layout.cols > 1:
        layout = pooled_layout(layout)
        steps.append(layout)
        if layout.shape in wanted:
            found.append(View(layout, partial(pooled_down, layouts=tuple(steps), by=HOW[how])))
    return found


def section(context: Context) -> Section:
    """Table I and Fig. 9."""
    layout = context.dataset.layout
    skins = layouts(layout)
    taxels = [skin.rows * skin.cols for skin in skins]
    views = [view for how in HOW for view in coarser(layout, how)]
    views += [
        View(layout, partial(masked, kept=thinned(layout.shape, share))) for share in SHARES[1:]
    ]
    series = context.follow_again("taxel resolution", views)
    X = [context.vectors(), *(vectors(found) for found in series)]
    levels = len(skins) - 1
    # The first views are those by the sum.
    means = [averaged(x, taxels[0] / n) for x, n in zip(X[: levels + 1], taxels, strict=True)]
    cases = [(x, context.labels) for x in (X if context.scene is None else [*X, *means])]
    results = context.map("its accuracy", grid_search, cases)
    for n, by_mean in zip(taxels, results[len(X) :], strict=False):
        for task, r in by_mean.items():
            context.ours[BY_MEAN.key, str(n), task] = percent(r.accuracy)
    results = results[: len(X)]
    table = Table(
        "resolution",
        "Larger taxels",
        ("taxels", "rows", "columns", "pooling", "task", *SCORE, "paper %", "without contact"),
    )
    by_how = {}
    for i, how in enumerate(HOW):
        part = slice(1 + i * levels, 1 + (i + 1) * levels)
        by_how[how] = [results[0], *results[part]]
        lost = [0, *(sum(s is None for s in found) for found in series[i * levels :][:levels])]
        for skin, n, found, none in zip(skins, taxels, by_how[how], lost, strict=True):
            for task, r in found.items():
                given = papers("I", task).get(str(n), "")
                cells = (n, skin.rows, skin.cols, how, task, *score(r), given, none)
                table.rows.append(cells)
                if how == "sum":
                    context.ours["I", str(n), task] = percent(r.accuracy)
    chips = Table(
        "chips",
        "The same taxels, fewer of them read",
        ("part of the chips", "taxels read", "task", *SCORE),
    )
    fewer = [results[0], *results[1 + 2 * levels :]]
    for share, found in zip(SHARES, fewer, strict=True):
        read = int((thinned(layout.shape, share) & layout.alive).sum())
        chips.rows += [(f"1/{share}", read, task, *score(r)) for task, r in found.items()]
    pictures = []
    for how, found in by_how.items():
        by_task = {task: [r[task] for r in found] for task in context.labels}
        theirs: dict[str, list[tuple[float, float]]] = {
            task: sorted((float(n), p) for n, p in papers("I", task).items())
            for task in by_task
            if papers("I", task) and context.scene
        }
        png = figures.lines(
            taxels,
            by_task,
            label="taxels",
            title=f"Effect of taxel resolution (Fig. 9), pooled by {how}",
            paper=theirs,
            logarithmic=True,
            ticks=[str(n) for n in taxels],
        )
        pictures.append(Figure(f"resolution_{how}", f"Resolution, {how}", png))
    png = figures.lines(
        SHARES,
        {task: [r[task] for r in fewer] for task in context.labels},
        label="chips of which one is read",
        title="Reading fewer chips",
        logarithmic=True,
        ticks=[str(s) for s in SHARES],
    )
    pictures.append(Figure("chips", "Fewer chips", png))
    return Section(
        "Effect of taxel resolution (Table I, Fig. 9)",
        [
            "A larger taxel carries all that presses on it, so what it reads is the sum of its "
            "parts' forces; that is what we set beside the paper. The maximum, a taxel that feels "
            "its most loaded part alone, is shown for comparison. The threshold in newtons stays. "
            "With one taxel, area says only whether there is contact and motion is that of the "
            "skin's middle, which the joint angles still give.",
            "Fewer chips: blocks of 4 x 3 taxels are left unread, spread like a checkerboard; "
            "this saves time on the wire, which larger taxels would too.",
        ],
        [table, chips],
        pictures,
    )
