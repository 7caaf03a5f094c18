"""The ways to use a model of some recordings: fixed windows and early decisions."""

from dataclasses import dataclass

from train.choose.evaluate import Result
from train.tradeoff.choices import WINDOWS_S
from train.tradeoff.early import Certified
from train.tradeoff.measured import Measured

EARLY = (
    "--leave-out trial",
    f"--decision-points {WINDOWS_S[0]}:{WINDOWS_S[-1]}:0.1",
)
"""Options that export the model whose early decisions were measured."""


@dataclass(frozen=True)
class Use:
    """A way to use a task, and its price.

    Attributes:
        name: of the way.
        seconds: mean time to the decision.
        result: its accuracy.
        commands: that make it.
        window_s: of a decision after a fixed time.
    """

    name: str
    seconds: float
    result: Result
    commands: tuple[str, ...]
    window_s: float | None = None

    def price(self, accuracy: float, measured: Measured) -> float:
        """The mean price of a decision at an accuracy."""
        return measured.wrong * (1.0 - accuracy) + measured.second * self.seconds


def fixed(measured: Measured, task: str, window_s: float) -> Use:
    """The decision of a task after a fixed window."""
    return Use(
        f"after {window_s:g} s",
        window_s + measured.after_s,
        measured.results(task)[window_s],
        (measured.commands.export(f"--window {window_s:g}"),),
        window_s,
    )


def early(measured: Measured, rule: Certified) -> Use:
    """The early decision with an error rate."""
    return Use(
        f"early, at most {rule.error:.0%} wrong",
        rule.mean_s + measured.after_s,
        rule.result,
        (measured.commands.export(*EARLY), measured.commands.run(rule.error)),
    )


def uses(measured: Measured, task: str) -> list[Use]:
    """Every fixed window and every early decision of a task, on the same contacts."""
    windows = [fixed(measured, task, window) for window in measured.results(task)]
    rules = measured.comparisons[task].certified
    return [*windows, *(early(measured, rule) for rule in rules)]


def cheapest(measured: Measured, task: str) -> Use:
    """The use of a task with the lowest mean price of a decision."""
    return min(
        uses(measured, task), key=lambda use: use.price(use.result.accuracy, measured)
    )
