"""The settings that a fit has chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from train.candidates import Candidate
from train.choose import Chosen, EarlySettings
from train.pipeline import Choice


@dataclass(frozen=True)
class Settings:
    """The settings that a fit has chosen.

    Attributes:
        chosen: {task: its settings}.
        folds: (n,) of the accuracies.
        without: [fold]{task: the choice made without the fold's trials}.
        tried: the candidates that they were chosen among.
        window_s: of the full decision.
        notes: sentences that a user should read.
        early: settings of earlier decision points; None where those of the full window
            serve for all.
    """

    chosen: dict[str, Chosen]
    folds: NDArray[np.int64]
    without: list[dict[str, Choice]]
    tried: Sequence[Candidate]
    window_s: float
    notes: list[str]
    early: EarlySettings | None = None

    @property
    def choices(self) -> dict[str, Choice]:
        """{task: its choice}."""
        return {task: settled.choice for task, settled in self.chosen.items()}

    @property
    def tested(self) -> int:
        """Number of trials that calibrate."""
        return int((self.folds >= 0).sum())

    def taken(self, *, folds: bool = False) -> set[str]:
        """The names of the features that the settings take.

        Args:
            folds: count those chosen without each fold too.
        """
        settings: list[Mapping[str, Choice]] = [self.choices]
        settings += self.without if folds else []
        if self.early is not None:
            early = self.early.settings
            settings.append(early.choices)
            settings += early.by_fold if folds else []
        return {
            name
            for choices in settings
            for choice in choices.values()
            for name in choice.features
        }
