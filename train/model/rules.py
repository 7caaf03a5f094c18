"""Stopping rules, certified by learn-then-test.

A rule decides at the first decision point whose confidence reaches a threshold, or
always at one window. Its error rate is bounded by learn-then-test (Angelopoulos, Bates,
Candès, Jordan and Lei, 2021). The hypothesis that a rule errs more often than `error`
is rejected by the exact binomial test on the calibration trials, at a level of
`TEST_SHARE` times `RISK`. The first hypothesis is that of the full window. If it is
rejected, its level passes in equal parts to the two families of rules. Each family is
walked from the most careful rule to the boldest until a test fails (fixed-sequence
testing within a graph: Bretz, Maurer, Brannath and Posch, 2009). The tests are monotone
in `error`. So a rule's certified error is the largest upper confidence limit met on the
way to it, and one table of rules serves every `error`. The confidences for the tests of
a fold's trials come from a logistic regression on the other folds.

Tasks that agree (`edge.decide.agreement`) have one rule: the factors are decided when
each is sure, their joint task when both are, and the tests count the joint task's
errors. Below the smallest error that is certified for the joint task, its factors wait
for the full window with it (`agreeing`).

The tests are exact for the average of the folds' models. The exported model is fitted
on all trials, a tenth (or a fifth) more, with its own choice of settings. On average it
errs a little less often, in a single case more or less often. On 200 data sets of 140
trials the two differ by a quarter to a third more than the binomial distribution
explains. With the full risk for the tests, the smallest certified error was exceeded in
14 to 22 of 100 sets instead of ten, so they take half of it. `make risk` counts it.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit
from scipy.stats import beta

from edge.arrays import Booleans, Floats, Integers
from edge.decide.early import TEST_SHARE, is_fixed
from edge.decide.info import StoppingRule

RISK = 0.1
"""Probability that a certificate is wrong."""
THRESHOLDS = np.round(expit(np.arange(8.0, -1.05, -0.1)), 4)
"""Confidences at which rules stop, evenly spaced in the logarithm of their odds."""
FULL_LEVEL = TEST_SHARE * RISK
"""Level of the test of the full window."""
NEVER = 2.0
"""A confidence that is never reached."""


def upper_limit(wrong: int, trials: int, level: float) -> float:
    """The largest error rate that `wrong` of `trials` does not reject at a level
    (exact)."""
    if wrong >= trials:
        return 1.0
    return float(beta.ppf(1.0 - level, wrong + 1, trials - wrong))


def stops(confidence: Floats, rule: StoppingRule, unusual: Booleans) -> Integers:
    """(n,) the decision point at which a rule decides, as `edge.Classifier` does.

    Args:
        confidence: (points, n) that the labels are right, by the curve of all points.
        rule: the rule.
        unusual: (points, n) whether the contact is unlike all trained ones, and so
            waits.
    """
    decides = (confidence >= rule.confidence) & ~unusual
    decides[rule.last :] = ~unusual[rule.last :]
    decides[-1] = True
    return np.asarray(decides.argmax(axis=0))


@dataclass(frozen=True)
class TimeSeries:
    """The answers of a task at each decision point, and how sure they are.

    Attributes:
        confidences: (decision points, n) of each part, by its curve of all points. The
            parts of a joint task are its two factors, and it is decided when both are;
            any other task is its only part.
        wrong: (decision points, n) of each part.
        unusual: (decision points, n) whether the contact is unlike all trained ones.
        withheld: (decision points, n) whether the task names nothing, as the object is
            unknown; None of a task that always answers.
    """

    confidences: Sequence[Floats]
    wrong: Sequence[Booleans]
    unusual: Booleans
    withheld: Booleans | None = None

    def under(self, rule: StoppingRule) -> tuple[Integers, Booleans]:
        """(n,) the decision point at which a rule decides, and whether the answer is
        wrong."""
        trials = np.arange(self.unusual.shape[1])
        at = [stops(confidence, rule, self.unusual) for confidence in self.confidences]
        last = np.max(at, axis=0)
        pairs = zip(self.wrong, at, strict=True)
        wrong = [of_part[points, trials] for of_part, points in pairs]
        if self.withheld is not None:
            wrong.append(self.withheld[last, trials])
        return last, np.any(wrong, axis=0)


def candidates(points: int) -> tuple[StoppingRule, list[list[StoppingRule]]]:
    """The full window's rule, and two families, each from the most careful to the
    boldest."""
    full = StoppingRule(1.0, 0.0, NEVER, points - 1)
    sure = [StoppingRule(1.0, 0.0, float(c), points - 1) for c in THRESHOLDS]
    fixed = [StoppingRule(1.0, 0.0, NEVER, last) for last in range(points - 2, -1, -1)]
    return full, [sure, fixed]


def tested(
    rule: StoppingRule,
    time_series: TimeSeries,
    seconds: Floats,
    level: float,
    before: float,
) -> StoppingRule:
    """A rule with the error that is certified for it, at least `before`, and its mean
    time."""
    at, wrong = time_series.under(rule)
    limit = upper_limit(int(wrong.sum()), time_series.unusual.shape[1], level)
    mean_s = float(seconds[at].mean())
    return StoppingRule(max(limit, before), mean_s, rule.confidence, rule.last)


def at_full_window(time_series: TimeSeries, seconds: Floats) -> StoppingRule:
    """The rule that always waits for the full window, tested first of all."""
    full, _ = candidates(len(seconds))
    return tested(full, time_series, seconds, FULL_LEVEL, 0.0)


def certify(time_series: TimeSeries, seconds: Floats) -> list[StoppingRule]:
    """The rules that no other rule beats in both certified error and mean time, the
    safest first.

    Args:
        time_series: of the task, on the calibration trials.
        seconds: (points,) windows.
    """
    _, families = candidates(len(seconds))
    passed = [at_full_window(time_series, seconds)]
    for family in families:
        before = passed[0].error
        for rule in family:
            level = FULL_LEVEL / len(families)
            passed.append(tested(rule, time_series, seconds, level, before))
            before = passed[-1].error
    # Among equal rules the fixed window comes first, as it needs no confidence.
    passed.sort(key=lambda rule: (rule.error, rule.mean_s, not is_fixed(rule)))
    best: list[StoppingRule] = []
    for rule in passed:
        if rule.error < 1.0 and (not best or rule.mean_s < best[-1].mean_s - 1e-9):
            best.append(rule)
    return best or [passed[0]]


def agreeing(
    joint: str,
    factors: Collection[str],
    rules: Mapping[str, Sequence[StoppingRule]],
    series: Mapping[str, TimeSeries],
    seconds: Floats,
) -> dict[str, list[StoppingRule]]:
    """{task: its rules} of a joint task and of its factors, which follow the joint
    task's rules at a pace of their own.

    A factor is wrong only where its joint task is, so it may follow the joint task's
    rules. Before them it waits for the full window: a joint task that is not certified
    must not be made of early factors. No rule is slower for a factor than those before
    it. The joint task, which takes its factors' labels, has the rules that both follow.

    Args:
        joint task: a task.
        factors: its factors.
        rules: {task: its certified rules}.
        series: {task: its time series}.
        seconds: (points,) windows.
    """
    least = rules[joint][0].error
    agreed = {}
    for factor in factors:
        waiting = at_full_window(series[factor], seconds)
        agreed[factor] = [waiting] if waiting.error < least else []
    of_joint: list[StoppingRule] = []
    for rule in rules[joint]:
        followed = _followed(rule, agreed, series, seconds)
        # A factor that goes on by itself would make the joint task err more often.
        if len(followed) == len(factors):
            of_joint.append(rule)
            for factor, of_factor in followed.items():
                agreed[factor].append(of_factor)
    return {joint: of_joint, **agreed}


def _followed(
    rule: StoppingRule,
    rules: Mapping[str, Sequence[StoppingRule]],
    series: Mapping[str, TimeSeries],
    seconds: Floats,
) -> dict[str, StoppingRule]:
    """{factor: a rule} of those that it makes no slower than their rules so far."""
    followed = {}
    for factor, before in rules.items():
        at, _ = series[factor].under(rule)
        mean_s = float(seconds[at].mean())
        if not before or mean_s <= before[-1].mean_s + 1e-9:
            followed[factor] = replace(rule, mean_s=mean_s)
    return followed
