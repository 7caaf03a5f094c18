"""What is left out to choose a task's settings and to measure them: single trials, or
entire groups of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from edge.arrays import Integers
from train.choose.candidates import Candidate, costs, places_of
from train.choose.evaluate import (
    VARIANCE,
    AnswerTable,
    Promise,
    Result,
    chosen_by_fold,
    chosen_by_other_fold,
    fold_numbers,
    nested_accuracy,
)
from train.choose.rule import Rule
from train.data.folds import SEED
from train.data.groups import TRIAL, Groups
from train.data.labels import NO_CONTACT
from train.data.vectors import Strings
from train.model.pipeline import Choice

HALVINGS = 20
UNSEEN_MARGIN = 0.01
"""Accuracy on left-out groups within which the cheaper candidate is taken."""


def rule_among(
    choices: Sequence[Choice],
    widths: Mapping[str, int],
    is_few: bool = False,
    margin: float = 0.0,
) -> Rule:
    """The rule that chooses among candidates: the cheapest of about the best, or the
    best where trials are few.

    Among few trials a standard error is wide, and the cheapest within it often less
    accurate: by 0 to 4 points on cuts of 54 trials of iCub, SDH-2 and simulated touches.
    Their answers are graded then, which chooses better by another point; on cuts of 120
    trials both together by 1.3 points.

    Args:
        choices: of the candidates.
        widths: columns of each feature.
        is_few: whether trials are few.
        margin: of a `Rule`.
    """
    return Rule(None if is_few else costs(choices, widths), margin=margin)


@dataclass(frozen=True)
class TrialsLeftOut:
    """The choice by answers to single trials that are left out.

    Attributes:
        table: the answers.
        widths: {feature: its columns}, by which a candidate has a price.
        is_few: whether there are too few trials for prices; see `rule_among`.
    """

    table: AnswerTable
    widths: Mapping[str, int]
    is_few: bool = False

    @property
    def name(self) -> str:
        """What is left out."""
        return TRIAL

    @property
    def folds(self) -> Integers:
        """(n,) the fold of each trial."""
        return self.table.folds

    def margin(self, task: str) -> float:
        """Accuracy within which the cheaper candidate is taken."""
        return 0.0

    def count(self, labels: Strings) -> int:
        """Number of groups among the trials with a label (n,); 0 for single trials."""
        return 0

    def rule(self, task: str) -> Rule:
        """The rule that chooses among the candidates."""
        choices = self.table.choices[task]
        return rule_among(choices, self.widths, self.is_few, self.margin(task))

    def choice(self, task: str) -> Choice:
        """A task's settings."""
        place = self.rule(task).choose(self.table.plain(task))
        return self.table.choices[task][place]

    def by_fold(self, task: str) -> list[Choice]:
        """[fold] a task's settings chosen without what is left out."""
        places = chosen_by_fold(self.table, task, self.rule(task))
        return [self.table.choices[task][place] for place in places]

    def without(self, task: str, folds: Integers) -> list[Choice]:
        """[fold] a task's settings chosen without the trials of one of the folds (n,)
        of single trials."""
        return self.by_fold(task)

    def accuracy(self, task: str) -> Result:
        """The nested accuracy of the choice."""
        return nested_accuracy(self.table, task, self.rule(task))

    def agreed(self, task: str) -> int:
        """In how many of `HALVINGS` divisions of the folds into two halves these choose
        the same features and projection."""
        answers = self.table.plain(task)
        rule = self.rule(task)
        numbers = fold_numbers(self.folds)
        draw = np.random.default_rng(SEED)
        agreed = 0
        for _ in range(HALVINGS):
            half = np.isin(self.folds, draw.permutation(numbers)[::2])
            kinds = set()
            for part in (half, ~half):
                choice = self.table.choices[task][rule.choose(answers[:, part])]
                kinds.add((choice.features, choice.projection))
            agreed += len(kinds) == 1
        return agreed

    def of_candidate(
        self, task: str, candidate: Candidate
    ) -> tuple[Result, Choice] | None:
        """The nested accuracy of a candidate's own choice, and this choice; None where
        it was dropped, or is none for the task."""
        choices = self.table.choices[task]
        allowed = places_of(candidate, choices)
        if not any(self.table.is_running(task, place) for place in allowed):
            return None
        rule = replace(self.rule(task), allowed=allowed, margin=0.0)
        place = rule.choose(self.table.plain(task))
        return nested_accuracy(self.table, task, rule), choices[place]


@dataclass(frozen=True)
class GroupsLeftOut(TrialsLeftOut):
    """The choice by answers to entire groups that are left out.

    Attributes:
        groups: of the trials.
    """

    groups: Groups = field(kw_only=True)

    @property
    def name(self) -> str:
        """What is left out."""
        return self.groups.name

    def margin(self, task: str) -> float:
        """Accuracy within which the cheaper candidate is taken."""
        return UNSEEN_MARGIN if task in self.groups.tasks else 0.0

    def count(self, labels: Strings) -> int:
        """Number of groups among the trials with a label (n,)."""
        return self.groups.count(labels)

    def without(self, task: str, folds: Integers) -> list[Choice]:
        """[fold] a task's settings chosen without the trials of one of the folds (n,)
        of single trials, by answers to left-out groups too."""
        places = chosen_by_other_fold(self.table, task, folds, self.rule(task))
        return [self.table.choices[task][place] for place in places]


def promised(result: Result, untouched: Sequence[str] = (), groups: int = 0) -> Promise:
    """A result as a promise of the accuracy on other trials, or on other groups.

    Args:
        result: on the trials with a contact.
        untouched: labels of the recordings without one. Missed touches count as wrong,
            and recordings of no touch as right.
        groups: number of the groups left out; 0 for single trials.
    """
    right = result.right + untouched.count(NO_CONTACT)
    total = result.total + len(untouched)
    variance = max(VARIANCE, total / groups if groups else 0.0)
    counted = {"right": right, "total": total, "variance": variance}
    return Promise(**{**vars(result), **counted})
