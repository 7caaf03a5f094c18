"""The ways to use a model of some recordings: fixed windows and early decisions."""

from dataclasses import dataclass

from train.choose.evaluate import Result
from train.tradeoff.choices import WINDOWS_S
from train.tradeoff.early import FOLDS, Certified, StoppingComparison
from train.tradeoff.measured import Measured

EARLY = (
    "--leave-out trial",
    f"--decision-points {WINDOWS_S[0]}:{WINDOWS_S[-1]}:0.1",
)
"""Options that export the model whose early decisions were measured."""


def distinct(compared: StoppingComparison) -> list[Certified]:
    """The rules that most folds certify; one that serves two error rates stands at the
    smaller."""
    able = [rule for rule in compared.certified if rule.folds > FOLDS // 2]
    rules = {(rule.mean_s, rule.wrong): rule for rule in reversed(able)}
    return list(rules.values())[::-1]


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


def uses(measured: Measured, task: str) -> list[Use]:
    """Every fixed window and every early decision of a task."""
    options = []
    for window, result in measured.results(task).items():
        command = measured.commands.export(f"--window {window:g}")
        seconds = window + measured.after_s
        options.append(Use(f"after {window:g} s", seconds, result, (command,), window))
    export = measured.commands.export(*EARLY)
    for rule in distinct(measured.comparisons[task]):
        name = f"early, at most {rule.error:.0%} wrong"
        seconds = rule.mean_s + measured.after_s
        run = f"edge-classify run --error {rule.error:g}"
        options.append(Use(name, seconds, rule.result, (export, run)))
    return options


def cheapest(measured: Measured, task: str) -> Use:
    """The use of a task with the lowest mean price of a decision."""
    return min(
        uses(measured, task), key=lambda use: use.price(use.result.accuracy, measured)
    )
