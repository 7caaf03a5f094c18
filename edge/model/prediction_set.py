"""Which labels a contact can still have, decision point by decision point."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from edge.errors import InputError

UNKNOWN = "unknown"
"""The label of a contact that no trained label fits."""
NOVELTY_RATE = 0.05
"""How often a contact with a trained thing may be called unknown for lying far from all."""


def check_rate(value: float, what: str) -> float:
    """The value where it is a rate inside (0, 1).

    Raises:
        InputError: it is not; the sentence names `what`.
    """
    if not 0.0 < value < 1.0:
        raise InputError(f"{what} must be above 0 and below 1, not {value:g}")
    return value


class PredictionSet:
    """The labels of one task that a contact can still have.

    At each decision point, a calibrated model gives a p-value for every label and fold of its
    calibration, and one for lying far from everything in training (see `train.conformal`). A
    label keeps the least p-value of its decision points in each fold, and is ruled out for good
    once their mean over the folds is at most `error`.

    Args:
        labels: how many there are.
        error: how often the true label may be ruled out, in (0, 1).
        novelty_rate: how often a trained thing may be called unknown for lying far from all.
    """

    def __init__(self, labels: int, error: float, novelty_rate: float = NOVELTY_RATE) -> None:
        self.error, self.novelty_rate = error, novelty_rate
        self._least: NDArray[np.float64] | None = None
        self._mean = np.ones(labels + 1)

    def narrow(self, pvalues: NDArray[np.float64]) -> None:
        """Take in the p-values (folds, labels + 1) of the next decision point."""
        self._least = pvalues if self._least is None else np.minimum(self._least, pvalues)
        self._mean = self._least.mean(axis=0)

    @property
    def pvalues(self) -> NDArray[np.float64]:
        """(labels,) over the decision points so far."""
        return self._mean[:-1]

    @property
    def remaining(self) -> list[int]:
        """Labels that are not ruled out, by their index."""
        return np.flatnonzero(self.pvalues > self.error).tolist()

    @property
    def unknown(self) -> bool:
        """No label remains, or the contact lies too far from everything in training."""
        return bool(self._mean[-1] <= self.novelty_rate) or not self.remaining

    @property
    def settled(self) -> bool:
        """No later decision point can change the answer: one label remains, or it is unknown."""
        return self.unknown or len(self.remaining) == 1

    def best(self, favourite: int) -> int:
        """The favourite (the vote's answer) where it remains, else the label likeliest to be.

        The vote at the full window is right oftener than the largest of p-values that account
        for every decision point.
        """
        if favourite in self.remaining:
            return favourite
        return int(self.pvalues.argmax())

    def confidence(self, label: int) -> float:
        """One less the smallest error (or rate of false alarms) that would leave another answer.

        Args:
            label: the answer; where the contact is unknown, it makes no difference.
        """
        if self.unknown:
            return float(1.0 - min(self.pvalues.max(), self._mean[-1]))
        return float(1.0 - np.delete(self.pvalues, label).max(initial=0.0))
