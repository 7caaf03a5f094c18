"""When a contact is decided: a calibrated confidence, and rules whose error rate is certified."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from edge.errors import InputError

UNKNOWN = "unknown"
"""The label of a contact that is unlike everything in training."""
NOVELTY_RATE = 0.02
"""How often a contact with a trained object may be called unknown. At this rate such answers are
counted among the certified errors."""


def check_rate(value: float, what: str) -> float:
    """The value where it is a rate inside (0, 1).

    Raises:
        InputError: it is not; the sentence names `what`.
    """
    if not 0.0 < value < 1.0:
        raise InputError(f"{what} must be above 0 and below 1, not {value:g}")
    return value


def margin(distances: Sequence[float], label: int) -> float:
    """Evidence for a label: how much farther the training trials of the nearest other one lie.

    Args:
        distances: (labels,) mean squared distances.
        label: index of the label.

    Returns:
        The difference of the roots; minus infinity where the label's own trials are infinitely
        far away, and 0 where there is no other label.
    """
    own = math.sqrt(distances[label])
    others = [d for other, d in enumerate(distances) if other != label]
    if not others:
        return 0.0
    return math.sqrt(min(others)) - own if own < math.inf else -math.inf


@dataclass(frozen=True)
class StoppingRule:
    """Decide at the first decision point that is sure enough, and at the last one in any case.

    Attributes:
        error: certified: decisions are wrong at most this often.
        mean_s: mean seconds from onset to decision, on the calibration trials.
        confidence: decide from this confidence on; above 1 none is enough, which makes the rule a
            fixed window.
        last: decision point at which to decide in any case.
    """

    error: float
    mean_s: float
    confidence: float
    last: int

    @property
    def fixed(self) -> bool:
        """The rule is to wait for a fixed window."""
        return self.confidence > 1.0


@dataclass(frozen=True)
class Stopping:
    """What a model knows about deciding one task early; see `train.stopping` for how it is made.

    Attributes:
        slopes, intercepts: of each decision point: the probability that the label is right is the
            logistic function of slope * `margin` + intercept.
        rules: rising in error, falling in mean time.
        trials: that the rules were certified with.
        wrong: how many of them were decided wrongly at the full window.
        risk: probability that a rule errs more often than its certificate says.
    """

    slopes: tuple[float, ...]
    intercepts: tuple[float, ...]
    rules: tuple[StoppingRule, ...]
    trials: int
    wrong: int
    risk: float

    @property
    def smallest_error(self) -> float:
        """The smallest error rate that is certified."""
        return self.rules[0].error

    def confidence(self, decision_point: int, distances: Sequence[float], label: int) -> float:
        """Probability that the label is right, 0 to 1."""
        slope, intercept = self.slopes[decision_point], self.intercepts[decision_point]
        x = slope * margin(distances, label) + intercept
        return 0.5 + 0.5 * math.tanh(0.5 * x)

    def rule(self, error: float) -> StoppingRule | None:
        """The fastest rule that is certified for an error rate; None where there is none."""
        able = [rule for rule in self.rules if rule.error <= error]
        return able[-1] if able else None

    def refusal(self, error: float) -> str:
        """Why an error rate cannot be certified, and what would help."""
        share = self.wrong / self.trials
        known = (
            f"the smallest error that {self.trials} calibration trials certify is "
            f"{self.smallest_error:.3f}"
        )
        if share >= error:
            return (
                f"{known}, and {share:.1%} of them are decided wrongly even at the full window: "
                "more trials alone will not do"
            )
        # Chernoff: so many trials with the same share of errors are enough.
        divergence = (1.0 - share) * math.log((1.0 - share) / (1.0 - error))
        if share > 0.0:
            divergence += share * math.log(share / error)
        needed = max(math.ceil(-math.log(self.risk) / divergence), self.trials + 1)
        return f"{known}; {error:g} needs about {needed} trials"

    def to_dict(self) -> dict[str, Any]:
        """As JSON holds it."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], points: int) -> Stopping:
        """Read `to_dict`.

        Args:
            values: parsed JSON.
            points: how many decision points the model has.

        Raises:
            KeyError, TypeError, ValueError: it is not what `to_dict` gives.
        """
        found = cls(
            slopes=tuple(map(float, values["slopes"])),
            intercepts=tuple(map(float, values["intercepts"])),
            rules=tuple(
                StoppingRule(
                    error=float(rule["error"]),
                    mean_s=float(rule["mean_s"]),
                    confidence=float(rule["confidence"]),
                    last=int(rule["last"]),
                )
                for rule in values["rules"]
            ),
            trials=int(values["trials"]),
            wrong=int(values["wrong"]),
            risk=float(values["risk"]),
        )
        if not (
            len(found.slopes) == len(found.intercepts) == points
            and all(map(math.isfinite, found.intercepts))
            and all(0.0 < slope < math.inf for slope in found.slopes)
            and found.rules
            and all(0 <= rule.last < points for rule in found.rules)
            and all(0.0 < rule.error <= 1.0 for rule in found.rules)
            and 0 <= found.wrong <= found.trials > 0
            and 0.0 < found.risk < 1.0
        ):
            raise ValueError("a stopping rule makes no sense")
        return found


@dataclass(frozen=True)
class Novelty:
    """When a contact is unlike everything in training.

    The distance to the nearest training trial is taken in the space of the task with most labels:
    of all tasks' spaces it keeps most of what distinguishes objects.

    Attributes:
        task: whose space it is.
        rates: shares of trained contacts that lie farther than the limits, falling.
        limits: (decision points, rates) distances.
    """

    task: str
    rates: tuple[float, ...]
    limits: tuple[tuple[float, ...], ...]

    def rate(self, decision_point: int, distance: float) -> float:
        """The smallest novelty rate at which the distance counts as unknown; 1 at none."""
        found = 1.0
        for rate, limit in zip(self.rates, self.limits[decision_point], strict=True):
            if distance > limit:
                found = rate
        return found

    def to_dict(self) -> dict[str, Any]:
        """As JSON holds it."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any], points: int) -> Novelty:
        """Read `to_dict`.

        Raises:
            KeyError, TypeError, ValueError: it is not what `to_dict` gives.
        """
        found = cls(
            str(values["task"]),
            tuple(map(float, values["rates"])),
            tuple(tuple(map(float, row)) for row in values["limits"]),
        )
        if (
            len(found.limits) != points
            or not found.rates
            or any(len(row) != len(found.rates) for row in found.limits)
        ):
            raise ValueError("the limits of novelty make no sense")
        return found
