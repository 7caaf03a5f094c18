"""The measurements that the trade-off's sections show."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from train.evaluate import Labels, Result
from train.tradeoff.board import Board
from train.tradeoff.choices import Points
from train.tradeoff.early import StoppingComparison


@dataclass(frozen=True)
class Saving:
    """One change, and the accuracy that it costs.

    Attributes:
        what: the change.
        cost: what it saves or costs, other than accuracy.
        tasks: {task: points gained, and the ends of their 95 % interval, on the same trials}.
        choice_s: seconds that one core took to choose and train; 0 where nothing was trained.
    """

    what: str
    cost: str
    tasks: Mapping[str, tuple[float, float, float]]
    choice_s: float = 0.0


@dataclass(frozen=True)
class Measured:
    """Accuracies and times of one data set on one board.

    Attributes:
        y: {task: (n,) labels}, the main task first.
        board: figures of the machine that decides.
        wire_s: from the end of the window until its last frame is read.
        breakaways: {object: seconds} until static friction breaks; empty without a scene.
        points: the quick choice at each window.
        comparisons: {task: deciding early beside fixed windows}.
        costs: changes beside the choice at the usual window.
        wrong, second: an owner's price of a wrong decision and of a second's wait.
        formats: what each number format costs and gives (`board.read_formats`); empty if unknown.
    """

    y: Labels
    board: Board
    wire_s: float
    breakaways: Mapping[str, float]
    points: Points
    comparisons: Mapping[str, StoppingComparison]
    costs: Sequence[Saving]
    wrong: float = 10.0
    second: float = 1.0
    formats: Sequence[Mapping[str, str | float]] = ()

    @property
    def after_s(self) -> float:
        """Seconds from the end of the window to the decision."""
        return self.wire_s + self.board.arithmetic_s

    def results(self, task: str) -> dict[float, Result]:
        """{window: accuracy of a task, trials left out}."""
        return {window: tasks[task].by_trial for window, tasks in self.points.items()}
