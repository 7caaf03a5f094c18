"""When and how a task is decided: the policies of a classifier."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Protocol

from edge.events import Decided
from edge.model.info import ModelInfo
from edge.model.model import Decision
from edge.model.novelty import UNKNOWN

AS_TRAINED = "as_trained"
"""Flag of a decision at distance 0 from a training trial: the two have the same
coordinates, which are all that the model compares. Nearly always the touch is that
trial, replayed. Features that were constant in training, or have no weight in the
projection, may differ."""
OUT_OF_RANGE = "out_of_range"
"""Flag of a decision on features that lie far outside those of the training trials. The
model cuts them off before it compares them; features that it cannot scale at all get no
label."""


def flags_of(doubts: Mapping[str, bool]) -> tuple[str, ...]:
    """The names of the doubts that hold."""
    return tuple(flag for flag, holds in doubts.items() if holds)


def rounded(confidence: float | None) -> float | None:
    """A confidence in millionths."""
    return None if confidence is None else round(confidence, 6)


@dataclass(frozen=True)
class Question:
    """A question to a policy: a task of a contact at a decision point.

    Attributes:
        blank: the task's answer, without a label yet.
        decision: the model's.
        unknown: whether the contact is unlike everything in training.
        decision_point: index of the decision point.
        decided: the answers to the contact's other tasks so far.
    """

    blank: Decided
    decision: Decision
    unknown: bool
    decision_point: int
    decided: Mapping[str, Decided]

    def answer(self, info: ModelInfo, doubts: Mapping[str, bool]) -> Decided:
        """The model's answer, with the flags of the doubts that hold."""
        decision = self.decision
        shared_doubts = {
            AS_TRAINED: decision.distances[0] == 0.0,
            OUT_OF_RANGE: decision.out_of_range,
            UNKNOWN: self.unknown,
        }
        return replace(
            self.blank,
            label=decision.label,
            confidence=rounded(decision.confidence),
            flags=(*self.blank.flags, *flags_of({**shared_doubts, **doubts})),
            nearest=tuple(map(info.trial, decision.neighbours.tolist())),
            decision=decision,
        )


class Policy(Protocol):
    """When and how a task is decided; one for each task of a classifier."""

    def answer(self, question: Question) -> Decided | None:
        """The answer at a decision point; None if the task goes on waiting."""


class FullWindow:
    """Decide at the end of the window, by the most votes."""

    def __init__(self, info: ModelInfo) -> None:
        self._info = info

    def answer(self, question: Question) -> Decided:
        """The model's answer."""
        return question.answer(self._info, {"tie": question.decision.tie})
