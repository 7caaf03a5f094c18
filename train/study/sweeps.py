"""The paper's own analyses of the features: its Tables I to III."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations
from typing import Any

from edge.arrays import Floats
from edge.features.vector import FEATURES, SAMPLES, WINDOW_S
from edge.record.recording import Recording
from edge.touch.arm import Chain
from edge.touch.layout import SkinLayout
from train.choose.evaluate import Result
from train.data.dataset import DataSet
from train.data.vectors import Labels
from train.model.scaling import OF_PAPER
from train.report.score import grid_search, score
from train.report.section import ReportTable, Row, Section
from train.report.skins import coarser, follow, vectors
from train.report.work import Workers
from train.simulate.scene_model import Scene
from train.study.paper import papers


@dataclass(frozen=True)
class Context:
    """A data set and the processes to work with.

    Attributes:
        dataset: contacts followed for up to 2 s.
        scene: the scene that the recordings were simulated from, if any.
        workers: the processes.
    """

    dataset: DataSet
    scene: Scene | None = None
    workers: Workers = field(default_factory=Workers)

    @property
    def labels(self) -> Labels:
        """{task: (n,) labels} of the tasks that have more than one class."""
        y = {task: self.dataset.labels(task) for task in self.dataset.tasks}
        return {task: labels for task, labels in y.items() if len(set(labels)) > 1}

    def vectors(self, names: Sequence[str] = FEATURES) -> Floats:
        """The trials' feature vectors."""
        return self.dataset.features(WINDOW_S, SAMPLES, names)


SUBSETS = tuple(names for size in (1, 2, 3) for names in combinations(FEATURES, size))

Results = Mapping[Any, Mapping[str, Result]]
"""{setting: {task: result}}."""


def rows(column: str, results: Results, table: str) -> list[Row]:
    """A row for each setting and task, with the accuracy in a table of the paper, where
    it has one."""
    cells = []
    for setting, tasks in results.items():
        for task, result in tasks.items():
            row: Row = {column: setting, "task": task, **score(result)}
            row["paper %"] = papers(table, task).get(str(setting), "")
            cells.append(row)
    return cells


def scaling(context: Context) -> Section:
    """Accuracy with each scaling (Table II)."""
    X = context.vectors()
    cases = {method: (X, context.labels, method) for method in OF_PAPER}
    return _compared(
        context,
        "scaling",
        "II",
        cases,
        "Scaling follows the paper's Eqs. 1 to 5. The statistics of a feature are "
        "taken over all of its samples in the training trials of a fold. Methods I and "
        "II differ only by a constant for each feature, and so do Method III and no "
        "scaling. PCA subtracts the mean, and the constant with it, so each pair is "
        "the same classifier and has the same accuracy here, up to rounding. In the "
        "paper, the two methods of a pair differ by up to 9.3 points (80 % and 75 %, "
        "72.14 % and 62.86 %). Either its statistics were not taken over all trials, "
        "or its PCA did not subtract the mean.",
    )


def features(context: Context) -> Section:
    """Accuracy with each combination of features (Table III)."""
    cases = {
        " ".join(names): (context.vectors(names), context.labels, "none", names)
        for names in SUBSETS
    }
    text = (
        "Each feature alone, each pair, and all three together; unscaled, over 1.2 s."
    )
    return _compared(context, "features", "III", cases, text)


def _compared(
    context: Context,
    column: str,
    table: str,
    cases: Mapping[str, tuple[Any, ...]],
    text: str,
) -> Section:
    """Our accuracies beside those of one of the paper's tables.

    Args:
        context: the data set.
        column: heading of the settings.
        table: II or III.
        cases: {setting: arguments of `grid_search`}.
        text: the section's paragraph.
    """
    answers = context.workers.map(column, grid_search, list(cases.values()))
    cells = rows(column, dict(zip(cases, answers, strict=True)), table)
    heading = f"Accuracy with each choice of {column}"
    return Section(
        f"Effect of {column} (Table {table})",
        [text],
        [ReportTable(column, heading, cells)],
    )


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
    """Accuracy with larger taxels (Table I)."""
    data = context.dataset
    recordings = [trial.recording for trial in data.trials]
    skins = [(data.layout, recordings), *coarser(data.layout, recordings)]
    cases = [(*skin, data.chain, context.labels) for skin in skins]
    answers = context.workers.map("taxel resolution", _with_skin, cases)
    cells = []
    for (layout, _), (results, untouched) in zip(skins, answers, strict=True):
        for row in rows("taxels", {layout.rows * layout.cols: results}, "I"):
            cells.append({**row, "without contact": untouched})
    return Section(
        "Effect of taxel resolution (Table I)",
        [
            "A larger taxel reads the whole force on its area, which is the sum over "
            "the taxels that it replaces. The threshold in newtons stays the same. "
            "With a single taxel, the contact area only tells whether there is "
            "contact, and the contact motion is that of the skin's middle, which "
            "follows from the joint angles.",
        ],
        [ReportTable("resolution", "Accuracy with larger taxels", cells)],
    )
