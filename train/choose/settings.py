"""The settings that a fit has chosen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from edge.arrays import Integers
from train.choose.candidates import Candidate
from train.choose.choose import Chosen, EarlySettings
from train.model.pipeline import Choice, Choices


@dataclass(frozen=True)
class Settings:
    """The settings that a fit has chosen.

    Attributes:
        chosen: {task: its settings}.
        folds: (n,) of the accuracies.
        without: [fold]{task: the choice made without the fold's trials}.
        candidates: that they were chosen among.
        window_s: of the full decision.
        notes: sentences that a user should read.
        early: settings of earlier decision points; None where those of the full window
            serve for all.
    """

    chosen: dict[str, Chosen]
    folds: Integers
    without: list[dict[str, Choice]]
    candidates: Sequence[Candidate]
    window_s: float
    notes: list[str]
    early: EarlySettings | None = None

    @property
    def choices(self) -> dict[str, Choice]:
        """{task: its choice}."""
        return {task: settled.choice for task, settled in self.chosen.items()}

    @property
    def of_known(self) -> Settings:
        """Those that are best for objects that were recorded, where groups were left
        out to choose the others."""
        chosen = dict(self.chosen)
        without = list(map(dict, self.without))
        for task, settled in self.chosen.items():
            if settled.choice_of_known is not None:
                chosen[task] = replace(settled, choice=settled.choice_of_known)
                for by_task, choice in zip(without, settled.known_by_fold, strict=True):
                    by_task[task] = choice
        early = self.early
        if early is not None:
            early = replace(early, settings=early.settings_of_known)
        return replace(self, chosen=chosen, without=without, early=early)

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
            early = self.early.settings
            settings.append(early.choices)
            settings += early.by_fold if folds else []
        names: set[str] = set()
        for choices in settings:
            names.update(*(choice.features for choice in choices.values()))
        return names
