"""The measurements that the sections of the trade-off show."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from train.choose.evaluate import Result
from train.data.vectors import Labels
from train.report.section import Row
from train.tradeoff.board import Board
from train.tradeoff.choices import Points
from train.tradeoff.commands import Commands
from train.tradeoff.early import EarlyDecisions


@dataclass(frozen=True)
class Measurements:
    """Accuracies and times of one data set on one board.

    Attributes:
        y: {task: (n,) labels}, the main task first.
        board: figures of the machine that decides.
        wire_s: from the end of the window until its last frame is read; None where the
            recordings do not tell the skin's wires.
        points: the choice at each window.
        certified: {task: its decisions at each error rate that is certified}.
        costs: a row for each change of the choice at the usual window
            (`costs.measure`).
        commands: that make these models.
        notes: sentences of the choice.
    """

    y: Labels
    board: Board
    wire_s: float | None
    points: Points
    certified: Mapping[str, Sequence[EarlyDecisions]]
    costs: Sequence[Row]
    commands: Commands
    notes: Sequence[str] = ()

    def results(self, task: str) -> dict[float, Result]:
        """{window: accuracy of a task on held-out trials}."""
        return {window: tasks[task].by_trial for window, tasks in self.points.items()}
