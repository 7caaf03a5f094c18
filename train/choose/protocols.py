"""The trials that are held out to choose a task's settings and to measure them, singly or
in entire groups."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from edge.arrays import Floats, Integers
from train.choose.candidates import Candidate, costs, places_of
from train.choose.evaluate import (
    VARIANCE,
    AnswerTable,
    NestedAccuracy,
    Result,
    RuleOf,
    fold_numbers,
)
from train.choose.rule import Rule
from train.data.groups import TRIAL, Groups
from train.data.labels import NO_CONTACT
from train.data.vectors import Strings
from train.model.pipeline import Choice


def rule_among(
    choices: Sequence[Choice],
    widths: Mapping[str, int],
    is_few: bool = False,
) -> Rule:
    """The rule that chooses among the candidates of a task without groups: the cheapest
    of about the best, or the best where trials are few.

    Among few trials a standard error is wide, and the cheapest within it often less
    accurate. Their answers are graded then (docs/measured.md).

    Args:
        choices: of the candidates.
        widths: columns of each feature.
        is_few: whether trials are few.
    """
    return Rule(None if is_few else costs(choices, widths))


@dataclass(frozen=True)
class Protocol:
    """The choice by answers to trials, or to entire groups of them, that are held out.

    Tasks whose groups are held out share their settings: those with the best mean, over
    these tasks, of the accuracies with trials and with groups held out. No price counts
    there, as a few groups hold most errors: the standard error among trials says little.

    Attributes:
        table: the answers to what is held out.
        rules: of the choice of a task.
        groups: that are held out; None for single trials.
        beside: the answers to what the other protocol leaves out; None of tasks without
            groups.
        sharing: the tasks that share their settings.
    """

    table: AnswerTable
    rules: RuleOf
    groups: Groups | None = None
    beside: AnswerTable | None = None
    sharing: Sequence[str] = ()

    @property
    def name(self) -> str:
        """The groups that are held out."""
        return TRIAL if self.groups is None else self.groups.name

    @property
    def folds(self) -> Integers:
        """(n,) the fold of each trial."""
        return self.table.folds

    def count(self, labels: Strings) -> int:
        """Number of groups among the trials with a label (n,); 0 for single trials."""
        return 0 if self.groups is None else self.groups.count(labels)

    def rule(self, task: str) -> Rule:
        """The rule that chooses among the candidates."""
        return self.rules(task, self.table.choices[task])

    def answers(self, task: str, shared: bool = True) -> Floats:
        """(candidates, n) the answers to each trial that choose a task's settings.

        Args:
            task: to choose for.
            shared: count the tasks that share its settings.
        """
        if self.beside is None:
            return self.table.plain(task)
        tasks = self.sharing if shared else [task]
        tables = (self.table, self.beside)
        return _mean(table.plain(task) for table in tables for task in tasks)

    def answers_without(self, task: str, fold: int) -> NDArray[Any]:
        """(candidates, others) those to the trials outside a fold, by fits without the
        fold. The fits of the other protocol may have seen its trials, which take no
        part in the choice otherwise."""
        if self.beside is None:
            return self.table.nested(task, fold)
        outside = self.folds != fold
        nested = [self.table.nested(task, fold) for task in self.sharing]
        others = [self.beside.plain(task)[:, outside] for task in self.sharing]
        running = self.table.running_without(task, fold)
        return _mean([*nested, *others]) * running[:, None]

    def choice(self, task: str) -> Choice:
        """A task's settings."""
        place = self.rule(task).choose(self.answers(task))
        return self.table.choices[task][place]

    def places(self, task: str, rule: Rule) -> list[int]:
        """[fold] the candidate chosen by a rule without what is held out."""
        numbers = fold_numbers(self.folds)
        return [rule.choose(self.answers_without(task, fold)) for fold in numbers]

    def by_fold(self, task: str) -> list[Choice]:
        """[fold] a task's settings chosen without what is held out."""
        places = self.places(task, self.rule(task))
        return [self.table.choices[task][place] for place in places]

    def accuracy(self, task: str) -> Result:
        """The nested accuracy of the choice."""
        return self.table.answered(task, self.places(task, self.rule(task)))

    def of_candidate(
        self, task: str, candidate: Candidate
    ) -> tuple[Result, Choice] | None:
        """The nested accuracy of a candidate's own choice, and this choice; None where
        it was dropped, or is none for the task."""
        choices = self.table.choices[task]
        allowed = places_of(candidate, choices)
        if not any(self.table.is_running(task, place) for place in allowed):
            return None
        rule = replace(self.rule(task), allowed=allowed)
        place = rule.choose(self.answers(task))
        result = self.table.answered(task, self.places(task, rule))
        return result, choices[place]


@dataclass(frozen=True)
class Protocols:
    """The choices by what is held out.

    Attributes:
        trials: of tasks without groups, by single trials.
        groups: of the tasks whose groups are held out; None where there are none.
        shared: the choice of these tasks without folds of single trials.
    """

    trials: Protocol
    groups: Protocol | None = None
    shared: Protocol | None = None

    def of(self, task: str) -> Protocol:
        """The protocol that settles a task."""
        if self.groups is not None and task in self.groups.sharing:
            return self.groups
        return self.trials

    def by_trial(self, task: str) -> Protocol:
        """The same choice, with folds of single trials."""
        if self.shared is not None and task in self.shared.sharing:
            return self.shared
        return self.trials


def _mean(answers: Iterable[NDArray[Any]]) -> Floats:
    """The mean of arrays of one shape."""
    return np.asarray(np.mean(list(answers), axis=0))


def nested_accuracy(
    result: Result, untouched: Sequence[str] = (), groups: int = 0
) -> NestedAccuracy:
    """A result with the interval of the accuracy on other trials, or on other groups.

    Args:
        result: on the trials with a contact.
        untouched: labels of the recordings without one. Missed touches count as wrong,
            and recordings of no touch as right.
        groups: number of the groups held out; 0 for single trials.
    """
    right = result.right + untouched.count(NO_CONTACT)
    total = result.total + len(untouched)
    variance = max(VARIANCE, total / groups if groups else 0.0)
    counted = {"right": right, "total": total, "variance": variance}
    return NestedAccuracy(**{**vars(result), **counted})
