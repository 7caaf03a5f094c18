"""How one of several candidates is chosen, and what is clearly behind, by paired
comparisons."""

from dataclasses import dataclass

import numpy as np

from edge.arrays import Booleans, Floats, Integers

BEHIND = 2.0
"""Standard errors of the difference to the best that are clearly behind."""


@dataclass(frozen=True)
class Rule:
    """How one of several candidates is chosen: the cheapest within one standard error
    of the best in cross-validation.

    The error is that of the difference to the best one on the same trials, which is
    smaller than the errors of the two accuracies, as candidates often err on the same
    trials.

    Attributes:
        prices: (candidates,) of each. At equal price the most accurate counts, then the
            first. Without prices the most accurate of all is taken.
        allowed: the candidates to choose from; all where None.
    """

    prices: Integers | None = None
    allowed: Integers | None = None

    def choose(self, right: Booleans | Floats) -> int:
        """The candidate chosen by answers (candidates, n): whether they are right, or
        what share of them."""
        candidates = np.arange(len(right)) if self.allowed is None else self.allowed
        means = right[candidates].mean(axis=1)
        if self.prices is None:
            return int(candidates[means.argmax()])
        prices = self.prices[candidates]
        best = np.array(
            [np.where(prices == p, means, -1.0).argmax() for p in np.unique(prices)]
        )
        answers = right[candidates[best]].astype(np.float64)
        worse = answers[means[best].argmax()] - answers
        error = worse.std(axis=1) / np.sqrt(right.shape[1])
        within = worse.mean(axis=1) <= error
        return int(candidates[best[within.argmax()]])

    def dropped(self, right: Booleans, grids: Integers) -> list[int]:
        """The grids of which no allowed candidate is likely to be chosen by further
        trials.

        They are clearly behind the best, or cost more than the candidate that would be
        chosen by these trials and are right in none that it has wrong.

        Args:
            right: (candidates, n) whether each answers a trial rightly.
            grids: (candidates,) the grid of each.
        """
        assert self.allowed is not None
        answers = right.astype(np.float64)
        means = answers.mean(axis=1)
        best = answers[self.allowed[means[self.allowed].argmax()]]
        choice = self.choose(right)
        dropped = []
        for grid in np.unique(grids[self.allowed]):
            places = self.allowed[grids[self.allowed] == grid]
            place = places[means[places].argmax()]
            worse = best - answers[place]
            behind = worse.mean() > BEHIND * worse.std() / np.sqrt(len(worse))
            is_dearer = self.prices is not None and (
                self.prices[place] > self.prices[choice]
            )
            if behind or (is_dearer and (answers[place] <= answers[choice]).all()):
                dropped.append(int(grid))
        return dropped


MOST_ACCURATE = Rule()
