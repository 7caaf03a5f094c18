"""Learn-then-test: exact limits, walks that stop at the first failure, certificates
that hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import binom

from edge.decide.early import TEST_SHARE
from edge.decide.info import StoppingRule
from train.model.rules import (
    NEVER,
    RISK,
    TimeSeries,
    agreeing,
    certify,
    stops,
    upper_limit,
)


class TestStops:
    CONFIDENCE = np.array([[0.9, 0.2, 0.9], [0.9, 0.8, 0.1], [0.1, 0.9, 0.2]])

    def stop(self, unknown=(), **rule):
        usual = {"error": 0.1, "mean_s": 1.0, "confidence": 0.7, "last": 2}
        waits = np.zeros((3, 3), dtype=bool)
        waits[tuple(np.array(unknown, dtype=int).reshape(-1, 2).T)] = True
        return stops(self.CONFIDENCE, StoppingRule(**{**usual, **rule}), waits).tolist()

    def test_at_the_first_decision_point_that_is_sure(self):
        assert self.stop() == [0, 1, 0]
        assert self.stop(confidence=0.9) == [0, 2, 0]

    def test_a_fixed_window_waits_for_it_and_no_longer(self):
        assert self.stop(confidence=NEVER, last=1) == [1, 1, 1]

    def test_what_is_unknown_waits_until_it_is_known_or_for_the_full_window(self):
        assert self.stop(unknown=[(0, 0), (1, 1), (2, 1)]) == [1, 2, 0]
        assert self.stop(unknown=[(0, 1), (1, 1)], confidence=NEVER, last=0) == [
            0,
            2,
            0,
        ]


SECONDS = np.array([0.4, 0.8, 1.2])


def time_series(confidence, wrong):
    """Of a task that is no joint task; no contact is unknown."""
    return TimeSeries([confidence], [wrong], np.zeros_like(wrong))


def drawn(n, rng):
    """Confidences that are the probability of being right, and outcomes drawn with
    them."""
    final = rng.beta(8.0, 1.0, n)
    confidence = np.stack([0.4 + 0.2 * final, 0.2 + 0.7 * final, final])
    right = rng.random(n) < confidence
    return confidence, right


def test_a_rule_is_certified_no_lower_than_those_tested_before_it():
    """Right answers at the first decision point count for nothing once the full window,
    which is tested first, has 20 of 100 wrong."""
    wrong = np.zeros((3, 100), dtype=bool)
    wrong[-1, :20] = True
    rules = certify(time_series(np.full((3, 100), 0.9), wrong), SECONDS)
    assert [rule.error for rule in rules] == [
        pytest.approx(upper_limit(20, 100, TEST_SHARE * RISK))
    ]


def test_certificates_fail_no_oftener_than_they_say():
    """Of 100 calibrations the share whose rule errs more often than certified; at most
    a tenth."""
    error = 0.2
    rng = np.random.default_rng(2)
    world_confidence, world = drawn(5_000, rng)
    failed = 0
    for _ in range(100):
        confidence, right = drawn(100, rng)
        able = [
            rule
            for rule in certify(time_series(confidence, ~right), SECONDS)
            if rule.error <= error
        ]
        if able:
            at = stops(world_confidence, able[-1], np.zeros_like(world))
            failed += 1.0 - world[at, np.arange(5_000)].mean() > error
    assert failed <= binom.ppf(0.99, 100, TEST_SHARE * RISK)


def test_equal_rules_are_a_fixed_window_and_certain_error_is_no_rule():
    """All are wrong at 0.4 s and none is later. Each is sure at 0.8 s."""
    wrong = np.zeros((3, 100), dtype=bool)
    wrong[0] = True
    confidence = np.outer([0.0, 1.0, 1.0], np.ones(100))
    full, fixed = certify(time_series(confidence, wrong), SECONDS)
    assert full == StoppingRule(full.error, 1.2, NEVER, 2)
    assert (fixed.confidence, fixed.last) == (NEVER, 1)


def test_a_task_is_wrong_where_it_names_nothing_when_it_is_decided():
    right = np.zeros((3, 2), dtype=bool)
    withheld = np.array([[True, False], [False, False], [False, True]])
    decided = TimeSeries([np.full((3, 2), 0.9)], [right], right, withheld)
    _, wrong = decided.under(StoppingRule(0.1, 1.0, 0.7, 2))
    assert wrong.tolist() == [True, False]


class TestJointTask:
    """Two factors and their joint task, which is decided when both are."""

    SLOW = np.array([[0.2, 0.2], [0.2, 0.9], [0.2, 0.9]])
    FAST = np.full((3, 2), 0.9)
    WRONG = np.array([[True, True], [True, False], [False, False]])

    def joint(self):
        right = np.zeros_like(self.WRONG)
        return TimeSeries(
            [self.FAST, self.SLOW], [right, self.WRONG], np.zeros_like(right)
        )

    def test_is_decided_with_the_later_factor_and_wrong_where_either_is(self):
        at, wrong = self.joint().under(StoppingRule(0.1, 1.0, 0.7, 2))
        assert at.tolist() == [2, 1]
        assert wrong.tolist() == [False, False]
        at, wrong = self.joint().under(StoppingRule(0.1, 1.0, NEVER, 0))
        assert at.tolist() == [0, 0]
        assert wrong.all()

    def agreeing(self, *rules):
        """The rules of the joint task and of its fast factor."""
        series = {
            "fast": time_series(self.FAST, np.zeros_like(self.WRONG)),
            "slow": time_series(self.SLOW, self.WRONG),
            "product": self.joint(),
        }
        factors = ("fast", "slow")
        by_task = agreeing("product", factors, {"product": rules}, series, SECONDS)
        return by_task["product"], by_task["fast"]

    LIMIT = upper_limit(0, 2, TEST_SHARE * RISK)
    WAITING = StoppingRule(LIMIT, 1.2, NEVER, 2)

    @pytest.mark.parametrize(
        ("rules", "follows"),
        [
            (((0.8, 1.2, NEVER, 2), (0.9, 1.0, 0.7, 2)), 2),
            # A factor is never slower at a looser error: both follow the first.
            (((0.8, 1.0, 0.7, 2), (0.9, 1.2, 0.95, 2)), 1),
        ],
    )
    def test_a_factor_follows_its_rules_at_its_own_pace_and_waits_before_them(
        self, rules, follows
    ):
        rules = [StoppingRule(*rule) for rule in rules]
        joint, factor = self.agreeing(*rules)
        assert joint == rules[:follows]
        *before, last = joint
        assert factor == [self.WAITING, *before, replace(last, mean_s=0.4)]


def test_a_family_has_half_the_level_and_goes_on_from_its_last_limit():
    """Of 100 trials 10 are wrong at 0.8 s and none at 0.4 s, which is tested after
    it."""
    wrong = np.zeros((3, 100), dtype=bool)
    wrong[1, :10] = True
    full, fast = certify(time_series(np.zeros((3, 100)), wrong), SECONDS)
    level = TEST_SHARE * RISK
    assert (full.last, full.error) == (2, upper_limit(0, 100, level))
    assert (fast.last, fast.error) == (0, upper_limit(10, 100, level / 2))
