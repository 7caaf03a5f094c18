"""The settings that a fit has chosen."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from edge.arrays import Integers
from train.choose.candidates import Candidate
from train.choose.evaluate import NestedAccuracy
from train.data.dataset import DataSet
from train.data.folds import finest, label_sets, stratified_folds
from train.data.vectors import Labels
from train.model.pipeline import Choice, Choices
from train.model.stopping import EarlySettings


@dataclass(frozen=True)
class Chosen:
    """The settings that a task is fitted with, and their accuracy.

    Attributes:
        choice: the features, scaling, projection and numbers.
        accuracy: nested accuracy of the entire choice, with entire groups held out
            where `held_out` is not `trial`. Tasks that agree are decided together, as
            the model does. Its interval is that of the exported model on other trials.
        by_trial: the same with single trials held out.
        held_out: `trial`, or the label whose groups were held out.
        candidates: nested accuracy of each candidate's own choice of numbers, by the
            task alone; None where it was dropped, or is none for the task.
        picks: the best settings of each candidate, likewise.
        folds: (n,) of `accuracy`.
        by_fold: [fold]{task: the choice without the fold's trials}, whose decisions
            `accuracy` counts: those of the task and of the tasks that are decided
            together with it.
    """

    choice: Choice
    accuracy: NestedAccuracy
    by_trial: NestedAccuracy
    held_out: str
    candidates: tuple[NestedAccuracy | None, ...] = ()
    picks: tuple[Choice | None, ...] = ()
    folds: Integers = field(default_factory=lambda: np.zeros(0, np.int64), repr=False)
    by_fold: tuple[dict[str, Choice], ...] = ()


def alone(choices: Choices) -> dict[str, Choice]:
    """The choices with one neighbour, which votes alone."""
    return {task: replace(choice, k=1) for task, choice in choices.items()}


@dataclass(frozen=True)
class Settings:
    """The settings that a fit has chosen.

    Attributes:
        chosen: {task: its settings}.
        folds: (n,) of the accuracies.
        without: [fold]{task: the choice made without the fold's trials}.
        candidates: that they were chosen among.
        window_s: of the full decision.
        early: settings of earlier decision points; None where those of the full window
            serve for all.
        prototypes: most of a set of labels; 0 where each trial is a row of the model.
    """

    chosen: dict[str, Chosen]
    folds: Integers
    without: list[dict[str, Choice]]
    candidates: Sequence[Candidate]
    window_s: float
    early: EarlySettings | None = None
    prototypes: int = 0

    def in_prototypes(self, count: int) -> Self:
        """The settings of a model whose rows are so many prototypes of each set of
        labels, of which the nearest alone votes."""
        early = self.early
        if early is not None:
            by_fold = list(map(alone, early.by_fold))
            early = EarlySettings(alone(early.choices), by_fold)
        chosen = {
            task: replace(settled, choice=replace(settled.choice, k=1))
            for task, settled in self.chosen.items()
        }
        without = list(map(alone, self.without))
        return replace(
            self, chosen=chosen, without=without, early=early, prototypes=count
        )

    def with_others(self, chosen_by: Integers, y: Labels) -> Self:
        """The settings with folds for all trials, of which some had no part in the
        choice.

        Args:
            chosen_by: (m,) the trials that had.
            y: {task: (n,) labels} of all.
        """
        folds = stratified_folds(y[finest(y)], len(self.without))
        folds[chosen_by] = self.folds
        return replace(self, folds=folds)

    @property
    def choices(self) -> dict[str, Choice]:
        """{task: its choice}."""
        return {task: settled.choice for task, settled in self.chosen.items()}

    def rows(self, dataset: DataSet) -> int:
        """Most rows of a model of some trials."""
        if not self.prototypes:
            return len(dataset.trials)
        y = {task: dataset.labels(task) for task in self.chosen}
        return self.prototypes * len(np.unique(label_sets(y)))

    @property
    def tested(self) -> int:
        """Number of trials that calibrate."""
        return int((self.folds >= 0).sum())

    def features(self, *, folds: bool = False) -> set[str]:
        """The names of the features that the settings take.

        Args:
            folds: count those chosen without each fold too.
        """
        settings: list[Choices] = [self.choices]
        settings += self.without if folds else []
        if self.early is not None:
            settings.append(self.early.choices)
            settings += self.early.by_fold if folds else []
        names: set[str] = set()
        for choices in settings:
            names.update(*(choice.features for choice in choices.values()))
        return names
