"""Policies of early decisions: a joint task is decided by its factors' decisions."""

from types import SimpleNamespace

import numpy as np
import pytest

from edge.decide.early import JointDecision, Uncertified, is_sure, paired
from edge.decide.events import Decided
from edge.decide.info import Stopping, StoppingRule, Task
from edge.decide.model import Decision


def task(*labels, **factors):
    return Task(labels, 1, 1, "none", 1.0, factors=factors)


TASKS = {
    "category": task("x-a", "y-a", "y-b", first=(0, 1, 1), second=(0, 0, 1)),
    "first": task("x", "y"),
    "second": task("a", "b"),
}
OWN = Decision("x-a", 0.2, 1.0, *[np.zeros(1)] * 3, False, np.zeros(3))
CANDIDATE = Decided("category", "x-a", 0.2, 0.6, 0.0, 1.0, ("tie",), decision=OWN)


def test_a_label_is_sure_from_the_rules_confidence_on_and_less_so_in_doubt():
    stopping = Stopping((), (), (), 0.5, 0.0, 1.0, (), 20, 0, 0.1)
    rule = StoppingRule(0.1, 1.0, 0.5, 2)
    assert is_sure(stopping, rule, [0.0, 4.0], 0, 2.0)
    assert not is_sure(stopping, rule, [0.0, 4.0], 0, 2.01)


SURE = StoppingRule(0.1, 0.6, 0.7, 2)
FIXED = StoppingRule(0.1, 0.6, 2.0, 1)


def factors(first, second, stops, confidences=(0.9, 0.8)):
    """The answers to the factors."""
    decided = {}
    pairs = zip(("first", "second"), (first, second), confidences, stops, strict=True)
    for name, label, confidence, stop in pairs:
        decided[name] = Decided(name, label, confidence, 0.6, 0.0, 1.0, stopped_by=stop)
    return decided


def answered(first, second, stops=("confidence",) * 2, rule=SURE):
    """The joint task's answer once its factors have these."""
    info = SimpleNamespace(tasks=TASKS, stopping={"category": None})
    policy = JointDecision(info, "category", rule, 0.1)
    return policy.answer(CANDIDATE, 1, factors(first, second, stops))


def test_a_task_that_is_not_certified_is_decided_at_the_last_point():
    policy = Uncertified(SimpleNamespace(decision_points_s=(0.6, 1.2)))
    assert policy.answer(CANDIDATE, 0, {}) is None
    answer = policy.answer(CANDIDATE, 1, {})
    assert answer.label == "x-a"
    assert "uncertified" in answer.flags


def test_a_joint_task_has_its_factors_labels_and_the_product_of_their_confidences():
    answer = answered("y", "b")
    assert answer.label == answer.decision.label == "y-b"
    assert answer.confidence == 0.72
    assert answer.error == 0.1
    assert answer.flags == ()


@pytest.mark.parametrize("confidence", [0.0, None])
def test_a_factor_without_confidence_leaves_its_joint_task_none(confidence):
    decided = factors("y", "b", ("confidence",) * 2, (0.9, confidence))
    info = SimpleNamespace(tasks=TASKS)
    assert paired(info, CANDIDATE, decided).confidence == 0.0


@pytest.mark.parametrize(
    ("stops", "stopped_by"),
    [
        (("confidence", "confidence"), "confidence"),
        (("confidence", "window"), "window"),
        (("window", "confidence"), "window"),
    ],
)
def test_a_joint_task_is_sure_where_both_factors_are(stops, stopped_by):
    answer = answered("y", "a", stops=stops)
    assert answer.stopped_by == stopped_by
    assert ("forced" in answer.flags) == (stopped_by == "window")
    assert "forced" not in answered("y", "a", stops, FIXED).flags


@pytest.mark.parametrize("first", ["x", None])
def test_a_pair_that_was_never_met_or_an_unknown_factor_has_no_name(first):
    answer = answered(first, "b")
    assert answer.label is None
    assert answer.confidence == 0.0
