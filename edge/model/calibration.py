"""The calibration of a model: how sure a decision is, when it may come early, and which
contacts are unlike everything in training."""

from __future__ import annotations

import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from edge.config import ConfigTable
from edge.errors import InputError

UNKNOWN = "unknown"
"""The label of a contact that is unlike everything in training."""
NOVELTY_RATE = 0.02
"""Rate at which contacts with trained objects may be called unknown. Such answers are
counted among the certified errors."""
TEST_SHARE = 0.5
"""Part of the risk that the tests on calibration trials take. The rest covers the
exported model, which errs more or less often than the folds' models do on average."""


def check_rate(value: float, name: str) -> None:
    """Refuse a rate outside (0, 1).

    Raises:
        InputError: the sentence begins with `name`.
    """
    if not 0.0 < value < 1.0:
        raise InputError(f"{name} must be above 0 and below 1, not {value:g}")


@dataclass(frozen=True)
class Novelty:
    """When a contact is unlike everything in training.

    The graph scores every contact in a space of its own (`train.novelty`).

    Attributes:
        task: with most labels. It names no label for an unknown contact: a new object
            can still be called soft or movable.
        rates: shares of trained contacts that score higher than the limits, falling
            from one half.
        limits: (decision points, rates) of the score.
    """

    task: str
    rates: tuple[float, ...]
    limits: tuple[tuple[float, ...], ...]

    def rate(self, decision_point: int, score: float) -> float:
        """The smallest novelty rate at which a score counts as unknown; 1 if it never
        does."""
        limits = zip(self.rates, self.limits[decision_point], strict=True)
        return min((rate for rate, limit in limits if score > limit), default=1.0)

    def excess(self, decision_point: int, score: float) -> float:
        """The logarithm of a score over that of half of the trained contacts; 0 below
        it."""
        typical = self.limits[decision_point][0]
        return math.log(score / typical) if score > typical > 0.0 else 0.0

    @classmethod
    def from_table(cls, table: ConfigTable, points: int) -> Novelty:
        """Read the table from the metadata of a model with this number of decision
        points.

        Raises:
            InputError: the table is damaged.
        """
        rates = table.numbers("rates")
        rows = table.get("limits")
        if not rates or not isinstance(rows, list | tuple) or len(rows) != points:
            raise table.fail(
                "limits", f"{points} rows of a number for each of the rates"
            )
        if not _rise((0.0, *rates[::-1], 1.0), strictly=True):
            raise table.fail("rates", "numbers between 0 and 1 that fall")
        limits = []
        for row in rows:
            line = ConfigTable({"limits": row}, table.where, table.prefix)
            limits.append(line.numbers("limits", len(rates)))
            if not _rise((0.0, *limits[-1])):
                raise table.fail("limits", "rows of numbers from 0 on that rise")
        return cls(table.text("task"), rates, tuple(limits))


def _rise(numbers: Sequence[float], *, strictly: bool = False) -> bool:
    """Whether each number is at least the one before it, or above it."""
    compare = operator.lt if strictly else operator.le
    return all(compare(before, after) for before, after in pairwise(numbers))


def margin(distances: Sequence[float], label: int) -> float:
    """Evidence for a label: how much farther the training trials of the nearest other
    one lie.

    Args:
        distances: (labels,) of `edge.model.Decision.label_distances`.
        label: index of the label.

    Returns:
        The difference. It is minus infinity if the label's own trials are infinitely
        far away, and 0 if there is no other label.
    """
    own_distance = distances[label]
    other_distances = [d for other, d in enumerate(distances) if other != label]
    nearest_other = min(other_distances, default=own_distance)
    return nearest_other - own_distance if own_distance < math.inf else -math.inf


def _logistic(x: float) -> float:
    return 0.5 + 0.5 * math.tanh(0.5 * x)


@dataclass(frozen=True)
class StoppingRule:
    """Decide at the first decision point that is sure enough, and at the last one in
    any case.

    A contact that is unknown there waits until it no longer is, or for the full window.

    Attributes:
        error: certified: decisions are wrong at most this often.
        mean_s: mean seconds from onset to decision, on the calibration trials.
        confidence: decide from this confidence on, by the curve of all decision points.
            Above 1 no confidence is enough, so the rule waits for a fixed window.
        last: decision point at which to decide in any case.
    """

    error: float
    mean_s: float
    confidence: float
    last: int

    @property
    def fixed(self) -> bool:
        """Whether the rule waits for a fixed window."""
        return self.confidence > 1.0


@dataclass(frozen=True)
class Stopping:
    """The calibration of one task's early decisions, which `train.stopping` makes.

    Attributes:
        slopes, intercepts, doubts: of each decision point: the probability that the
            label is right is the logistic function of slope * `margin` + intercept -
            doubt * `Novelty.excess`.
        slope, intercept, doubt: the same of all decision points together, for the
            rules. A point's own curve seldom rises high early, so with it the rules
            would wait on clear contacts too.
        rules: in the order of rising error. Mean times fall along them, except from a
            factor's own rules to those that it shares with its product (see
            `edge.model.agreement`).
        trials: number of trials that certify the rules.
        wrong: number of these trials that are decided wrongly at the full window.
        risk: probability that a rule errs more often than its certificate says.
    """

    slopes: tuple[float, ...]
    intercepts: tuple[float, ...]
    doubts: tuple[float, ...]
    slope: float
    intercept: float
    doubt: float
    rules: tuple[StoppingRule, ...]
    trials: int
    wrong: int
    risk: float

    @property
    def smallest_error(self) -> float:
        """The smallest error rate that is certified."""
        return self.rules[0].error

    def confidence(
        self,
        decision_point: int,
        distances: Sequence[float],
        label: int,
        excess: float,
    ) -> float:
        """Probability, 0 to 1, that a label is right.

        Args:
            decision_point: its index.
            distances: (labels,) of `edge.model.Decision.label_distances`.
            label: its index.
            excess: the contact's `Novelty.excess`.
        """
        log_odds = self.slopes[decision_point] * margin(distances, label)
        log_odds += self.intercepts[decision_point]
        return _logistic(log_odds - self.doubts[decision_point] * excess)

    def sure(
        self,
        rule: StoppingRule,
        distances: Sequence[float],
        label: int,
        excess: float,
    ) -> bool:
        """Whether a label is sure enough for a rule; see `confidence`."""
        log_odds = self.slope * margin(distances, label) + self.intercept
        return _logistic(log_odds - self.doubt * excess) >= rule.confidence

    def rule(self, error: float) -> StoppingRule | None:
        """The fastest rule that is certified for an error rate; or None."""
        able = [rule for rule in self.rules if rule.error <= error]
        return able[-1] if able else None

    @classmethod
    def from_table(cls, table: ConfigTable, points: int) -> Stopping:
        """Read the table from the metadata of a model with this number of decision
        points.

        Raises:
            InputError: the table is damaged.
        """
        trials = table.whole("trials", allowed=range(1, 1 << 31))
        return cls(
            slopes=table.numbers("slopes", points, low=0.0, open_low=True),
            intercepts=table.numbers("intercepts", points),
            doubts=table.numbers("doubts", points, low=0.0),
            slope=table.number("slope", low=0.0, open_low=True),
            intercept=table.number("intercept"),
            doubt=table.number("doubt", low=0.0),
            rules=tuple(
                StoppingRule(
                    error=rule.number("error", low=0.0, high=1.0, open_low=True),
                    mean_s=rule.number("mean_s"),
                    confidence=rule.number("confidence"),
                    last=rule.whole("last", allowed=range(points)),
                )
                for rule in table.tables("rules", f"{table.prefix}rules")
            ),
            trials=trials,
            wrong=table.whole("wrong", allowed=range(trials + 1)),
            risk=table.number("risk", low=0.0, high=1.0, open_low=True),
        )
