"""The paper's own analyses of the features: Figs. 6 to 10, Tables I to III."""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import Any

from edge.features.vector import FEATURES
from edge.record.recording import Recording
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout
from train.choose.evaluate import Result
from train.data.vectors import Labels
from train.model.scaling import OF_PAPER
from train.report import figures
from train.report.score import grid_search, score
from train.report.section import Row, Section, Table
from train.report.skins import coarser, follow, vectors
from train.study.context import Context
from train.study.paper import papers

WINDOWS_S = tuple(tenths / 10 for tenths in (*range(1, 12), *range(12, 21, 2)))
SUBSETS = tuple(names for size in (1, 2, 3) for names in combinations(FEATURES, size))

Results = Mapping[Any, Mapping[str, Result]]
"""{setting: {task: result}}."""


def by_task(results: Results) -> dict[str, list[Result]]:
    """{task: its result in each setting}."""
    tasks = next(iter(results.values()))
    return {task: [result[task] for result in results.values()] for task in tasks}


def rows(column: str, results: Results, table: str = "") -> list[Row]:
    """A row for each setting and task, with the accuracy in a table of the paper, if
    given."""
    cells = []
    for setting, tasks in results.items():
        for task, result in tasks.items():
            row: Row = {column: setting, "task": task, **score(result)}
            if table:
                row["paper %"] = papers(table, task).get(str(setting), "")
            cells.append(row)
    return cells


def confusion(context: Context) -> Section:
    """Confusion matrices of the paper's classifier (Figs. 6 to 8)."""
    best: list[Row] = []
    pictures = []
    for task, result in grid_search(context.vectors(), context.labels).items():
        truth = context.labels[task]
        assert result.answers is not None
        size = {"task": task, "classes": len(set(truth)), "trials": result.total}
        best.append(size | score(result))
        title = f"{task}: the label that each touch was given, by leave-one-out"
        pictures.append(
            figures.confusion(f"confusion_{task}", title, truth, result.answers)
        )
    return Section(
        "Classification (Figs. 6 to 8)",
        [
            "The classifier uses the paper's three features over 1.2 s, unscaled. A "
            "grid search with leave-one-out tries 1 to 20 components and k from 1 to "
            "20, and takes the smallest of equally accurate models. The accuracy shown "
            "is the one that the search maximised, so it is too high."
        ],
        [
            Table(
                "classification",
                "The best number of components and k for each task",
                best,
            )
        ],
        pictures,
    )


def window(context: Context) -> Section:
    """Accuracy at each time window (Fig. 10)."""
    cases = [(context.vectors(seconds), context.labels) for seconds in WINDOWS_S]
    answers = context.workers.map("time window", grid_search, cases)
    results = dict(zip(WINDOWS_S, answers, strict=True))
    text = ["As in the paper, each feature is sampled 40 times in every window."]
    for task in context.labels:
        at = {seconds: result[task].accuracy for seconds, result in results.items()}
        text.append(
            f"{task}: {at[0.8]:.1%} of the decisions are right after 0.8 s, "
            f"{at[1.2]:.1%} after 1.2 s and {at[2.0]:.1%} after 2 s."
        )
    if "category" in context.labels and context.scene is not None:
        text.append(
            "In the paper, accuracy falls substantially when the window is shortened "
            "from 1.2 s to 0.8 s. Physics sets a limit: a movable object cannot be "
            "distinguished from a fixed one before static friction breaks."
        )
    title = "Effect of the time window (Fig. 10)"
    png = figures.lines(
        "window",
        title,
        WINDOWS_S,
        by_task(results),
        label="seconds from first contact",
    )
    table = Table("window", "Accuracy at each window", rows("window s", results))
    return Section(title, text, [table], [png])


def scaling(context: Context) -> Section:
    """Accuracy with each scaling (Table II)."""
    text = (
        "Scaling follows the paper's Eqs. 1 to 5. The statistics of a feature are "
        "taken over all of its samples in the training trials of a fold. Methods I and "
        "II differ only by a constant for each feature, and so do Method III and no "
        "scaling. PCA subtracts the mean, and the constant with it, so each pair is "
        "the same classifier and has the same accuracy here, up to rounding. In the "
        "paper, the two methods of a pair differ by up to 9.3 points (80 % and 75 %, "
        "72.14 % and 62.86 %). Either its statistics were not taken over all trials, "
        "or its PCA did not subtract the mean."
    )
    cases = {method: (context.vectors(), context.labels, method) for method in OF_PAPER}
    return _compared(
        context,
        "scaling",
        "Effect of feature scaling (Table II)",
        "II",
        cases,
        text,
    )


def features(context: Context) -> Section:
    """Accuracy with each combination of features (Table III)."""
    text = (
        "Each feature alone, each pair, and all three together; unscaled, over 1.2 s."
    )
    cases = {
        " ".join(names): (context.vectors(names=names), context.labels, "none", names)
        for names in SUBSETS
    }
    return _compared(
        context,
        "features",
        "Effect of the features (Table III)",
        "III",
        cases,
        text,
    )


def _compared(
    context: Context,
    column: str,
    title: str,
    table: str,
    cases: Mapping[str, tuple[Any, ...]],
    text: str,
) -> Section:
    """Our accuracies beside those of one of the paper's tables.

    Args:
        context: the data set.
        column: heading of the settings.
        title: of the section.
        table: II or III.
        cases: {setting: arguments of `grid_search`}.
        text: the section's paragraph.
    """
    answers = context.workers.map(column, grid_search, list(cases.values()))
    results = dict(zip(cases, answers, strict=True))
    theirs = _papers_of(context, table)
    png = figures.bars(column, title, list(results), by_task(results), marks=theirs)
    heading = f"Accuracy with each choice of {column}"
    cells = Table(column, heading, rows(column, results, table))
    return Section(title, [text], [cells], [png])


def _papers_of(context: Context, table: str) -> dict[str, dict[str, float]] | None:
    """The paper's accuracies beside which a simulation of its scene stands."""
    if context.scene is None:
        return None
    return {task: papers(table, task) for task in context.labels}


def _with_skin(
    layout: SkinLayout,
    recordings: Sequence[Recording],
    arm: Chain | None,
    labels: Labels,
) -> tuple[Mapping[str, Result], int]:
    """Each task's accuracy with a skin, and the number of trials without contact."""
    contacts = follow(recordings, layout, arm)
    return grid_search(vectors(contacts), labels), contacts.count(None)


def resolution(context: Context) -> Section:
    """Accuracy with larger taxels (Table I, Fig. 9)."""
    data = context.dataset
    labels = context.labels
    recordings = [trial.recording for trial in data.trials]
    skins = [(data.layout, recordings), *coarser(data.layout, recordings)]
    cases = [(*skin, data.chain, labels) for skin in skins]
    answers = context.workers.map("taxel resolution", _with_skin, cases)
    taxels = [layout.rows * layout.cols for layout, _ in skins]
    accuracies, counts = zip(*answers, strict=True)
    results = dict(zip(taxels, accuracies, strict=True))
    without_contact = dict(zip(taxels, counts, strict=True))
    title = "Effect of taxel resolution (Table I, Fig. 9)"
    png = figures.lines(
        "resolution",
        title,
        taxels,
        by_task(results),
        label="taxels",
        paper=_papers_of(context, "I"),
        ticks=list(map(str, taxels)),
    )
    cells = rows("taxels", results, "I")
    for row in cells:
        row["without contact"] = without_contact[row["taxels"]]
    return Section(
        title,
        [
            "A larger taxel reads the whole force on its area, which is the sum over "
            "the taxels that it replaces. The threshold in newtons stays the same. "
            "With a single taxel, the contact area only tells whether there is "
            "contact, and the contact motion is that of the skin's middle, which "
            "follows from the joint angles.",
        ],
        [Table("resolution", "Accuracy with larger taxels", cells)],
        [png],
    )
