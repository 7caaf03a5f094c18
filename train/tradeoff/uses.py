"""The ways to use a model of some recordings: fixed windows and early decisions."""

from dataclasses import dataclass

from train.choose.evaluate import Result
from train.tradeoff.choices import WINDOWS_S, unseen
from train.tradeoff.early import EarlyDecisions
from train.tradeoff.measured import Measurements

EARLY = (
    "--leave-out trial",
    f"--decision-points {WINDOWS_S[0]}:{WINDOWS_S[-1]}:0.1",
)
"""Options that export the model whose early decisions were measured."""


@dataclass(frozen=True)
class Use:
    """A way to use a task.

    Attributes:
        name: of the way.
        seconds: mean time to the decision, from first contact.
        result: its accuracy.
        unseen: its accuracy on unseen objects; None if no objects could be held out.
        commands: that make it.
    """

    name: str
    seconds: float
    result: Result
    unseen: float | None
    commands: tuple[str, ...]


def fixed(measured: Measurements, task: str, window_s: float) -> Use:
    """The decision of a task after a fixed window."""
    choice = measured.points[window_s][task]
    return Use(
        f"after {window_s:g} s",
        window_s,
        choice.by_trial,
        unseen(choice),
        (measured.commands.export(f"--window {window_s:g}"),),
    )


def early(measured: Measurements, rule: EarlyDecisions) -> Use:
    """The early decision with an error rate."""
    return Use(
        f"early, at most {rule.error:.0%} wrong",
        rule.mean_s,
        rule.result,
        None if rule.unseen is None else float(rule.unseen.mean()),
        (measured.commands.export(*EARLY), measured.commands.run(rule.error)),
    )


def uses(measured: Measurements, task: str) -> list[Use]:
    """Every fixed window and every early decision of a task, on the same contacts."""
    windows = [fixed(measured, task, window) for window in measured.results(task)]
    rules = measured.certified[task]
    return [*windows, *(early(measured, rule) for rule in rules)]
