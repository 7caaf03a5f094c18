"""Effect of taxel resolution (Table I, Fig. 9), by larger taxels and by fewer chips."""

from __future__ import annotations

from functools import partial

import numpy as np

from edge.touch.layout import SkinLayout
from train.report import figures
from train.report.score import grid_search, score
from train.report.section import Figure, Section, Table
from train.report.skins import View, masked, pooled_down, pooled_layout, thinned, vectors
from train.study.classify import by_task, numbers
from train.study.context import Context
from train.study.paper import papers

POOLING = {"sum": np.add, "maximum": np.maximum}
SHARES = (1, 2, 4, 8)


def layouts(layout: SkinLayout) -> list[SkinLayout]:
    """The skin, then 2 x 2 of its taxels as one again and again, down to one taxel."""
    steps = [layout]
    while steps[-1].rows * steps[-1].cols > 1:
        steps.append(pooled_layout(steps[-1]))
    # The paper goes from 6 taxels to 1 in one step.
    return [skin for skin in steps if not 1 < skin.rows * skin.cols < 4]


def coarser(layout: SkinLayout, how: str) -> list[View]:
    """The views by every skin of `layouts` but the first."""
    wanted = {skin.shape for skin in layouts(layout)[1:]}
    views: list[View] = []
    steps: list[SkinLayout] = []
    while layout.rows * layout.cols > 1:
        layout = pooled_layout(layout)
        steps.append(layout)
        if layout.shape in wanted:
            views.append(View(layout, partial(pooled_down, layouts=tuple(steps), by=POOLING[how])))
    return views


def section(context: Context) -> Section:
    """Table I and Fig. 9."""
    layout, labels = context.dataset.layout, context.labels
    skins = layouts(layout)
    taxels = [skin.rows * skin.cols for skin in skins]
    views = [view for how in POOLING for view in coarser(layout, how)]
    views += [
        View(layout, partial(masked, kept=thinned(layout.shape, share))) for share in SHARES[1:]
    ]
    series = context.follow_again("taxel resolution", views)
    lost = [sum(contact is None for contact in contacts) for contacts in series]
    full, X = context.vectors(), [vectors(contacts) for contacts in series]
    levels = len(skins) - 1
    cases = [(x, labels) for x in [full, *X]]
    plain, *results = context.map("its accuracy", grid_search, cases)
    pooled = {
        how: [plain, *results[i * levels : (i + 1) * levels]] for i, how in enumerate(POOLING)
    }
    fewer = [plain, *results[2 * levels :]]
    rows, pictures = [], []
    for i, (how, steps) in enumerate(pooled.items()):
        without = [0, *lost[i * levels : (i + 1) * levels]]
        rows += [
            {"taxels": n, "rows": skin.rows, "columns": skin.cols, "pooling": how, "task": task}
            | score(result)
            | {"paper %": papers("I", task).get(str(n), ""), "without contact": untouched}
            for skin, n, step, untouched in zip(skins, taxels, steps, without, strict=True)
            for task, result in step.items()
        ]
        png = figures.lines(
            taxels,
            by_task(steps),
            label="taxels",
            title=f"Effect of taxel resolution (Fig. 9), pooled by {how}",
            paper={task: {float(n): p for n, p in papers("I", task).items()} for task in labels}
            if context.scene
            else None,
            names=[str(n) for n in taxels],
        )
        pictures.append(Figure(f"resolution_{how}", f"Resolution, {how}", png))
    png = figures.lines(
        SHARES,
        by_task(fewer),
        label="chips of which one is read",
        title="Reading fewer chips",
        names=[str(share) for share in SHARES],
    )
    pictures.append(Figure("chips", "Fewer chips", png))
    read = [int((thinned(layout.shape, share) & layout.alive).sum()) for share in SHARES]
    chips = [
        {"share of the chips": f"1/{share}", "taxels read": n, "task": task, **score(result)}
        for share, n, tasks in zip(SHARES, read, fewer, strict=True)
        for task, result in tasks.items()
    ]
    names = [str(n) for n in taxels]
    return Section(
        "Effect of taxel resolution (Table I, Fig. 9)",
        [
            "A larger taxel carries all the force on its area, so its reading is the sum of the "
            "taxels that it covers; those numbers are compared with the paper's. The maximum, as "
            "if it felt only the most loaded of them, is shown beside. The threshold in newtons "
            "stays the same. With one taxel, area shows only whether there is contact, and motion "
            "is that of the skin's middle, which the joint angles still give.",
            "Fewer chips: blocks of 4 x 3 taxels are left unread, spread like a checkerboard. Like "
            "larger taxels, this saves time on the wire.",
        ],
        [
            Table("resolution", "Larger taxels", rows),
            Table("chips", "The same taxels, fewer of them read", chips),
        ],
        pictures,
        numbers=numbers("I", dict(zip(names, pooled["sum"], strict=True))),
    )
