"""Early decisions: policies that follow the stopping rules certified for an error rate."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace

from edge.errors import InputError
from edge.events import Decided
from edge.model.agreement import product_label
from edge.model.info import ModelInfo
from edge.model.model import Model
from edge.model.novelty import UNKNOWN, check_rate
from edge.model.stopping import StoppingRule
from edge.policy import Policy, Question, rounded

LOG = logging.getLogger(__name__)


def policies(model: Model, error: float) -> Mapping[str, Policy]:
    """{task: its policy} for an error rate.

    Raises:
        InputError: the rate is outside (0, 1), or is certified for no task.
    """
    policy_of: dict[str, Policy] = {}
    for task, rule in stopping_rules(model, error).items():
        if rule is None:
            policy_of[task] = Uncertified(model.info)
        else:
            kind = Product if task in model.info.products else Early
            policy_of[task] = kind(model.info, task, rule, error)
    return policy_of


class Uncertified:
    """Decide at the end of the window, as without an error rate, and say so."""

    def __init__(self, info: ModelInfo) -> None:
        self._info = info
        self._full = len(info.decision_points_s) - 1

    def answer(self, question: Question) -> Decided | None:
        """The model's answer at the last decision point."""
        if question.decision_point < self._full:
            return None
        doubts = {"tie": question.decision.tie, "uncertified": True}
        return question.answer(self._info, doubts)


class Early:
    """Decide at the first decision point that is sure enough, or at the rule's last."""

    def __init__(
        self, info: ModelInfo, task: str, rule: StoppingRule, error: float
    ) -> None:
        """Follow a rule.

        Args:
            info: the model's metadata.
            task: that is decided.
            rule: certified for the error rate.
            error: the error rate.
        """
        self._info = info
        self._task = task
        self._rule = rule
        self._error = error
        self._stopping = info.stopping[task]
        self._full = len(info.decision_points_s) - 1

    def answer(self, question: Question) -> Decided | None:
        """The answer at a decision point; None if the task goes on waiting.

        An unknown contact waits for the full window.
        """
        rule = self._rule
        sure = self._sure(rule, question)
        last = self._full if question.unknown else rule.last
        if question.decision_point < last and (question.unknown or not sure):
            return None
        return self._answered(question, question.decision.confidence, sure)

    def _sure(self, rule: StoppingRule, question: Question) -> bool:
        decision = question.decision
        if decision.label_distances is None or self._info.novelty is None:
            raise InputError(f"the model gives no distances of {self._task}'s labels")
        label = self._info.tasks[self._task].labels.index(decision.label)
        excess = self._info.novelty.excess(question.decision_point, decision.novelty)
        distances = decision.label_distances.tolist()
        return self._stopping.sure(rule, distances, label, excess)

    def _answered(
        self, question: Question, confidence: float | None, sure: bool
    ) -> Decided:
        """The answer of the rule."""
        nameless = question.unknown and self._names_unknown()
        forced = not self._rule.fixed and not sure
        answer = question.answer(self._info, {"unsure": forced and not nameless})
        if nameless:
            answer = replace(answer, label=UNKNOWN)
            confidence = 1.0 - self._novelty(question)
        answer = replace(answer, confidence=rounded(confidence))
        stopped_by = "confidence" if sure else "window"
        return replace(answer, error=self._error, stopped_by=stopped_by)

    def _names_unknown(self) -> bool:
        novelty = self._info.novelty
        return novelty is not None and novelty.task == self._task

    def _novelty(self, question: Question) -> float:
        """The smallest novelty rate at which the contact counts as unknown."""
        novelty = self._info.novelty
        if novelty is None:
            return 1.0
        return novelty.rate(question.decision_point, question.decision.novelty)


class Product(Early):
    """Decide when both factors are, by their labels."""

    def answer(self, question: Question) -> Decided | None:
        """The answer once both factors have theirs."""
        task = self._info.tasks[self._task]
        if not question.decided.keys() >= task.factors.keys():
            return None
        indices = {}
        confidence = 1.0
        sure = True
        for factor in task.factors:
            decided = question.decided[factor]
            labels = self._info.tasks[factor].labels
            indices[factor] = labels.index(str(decided.label))
            confidence *= decided.confidence or 0.0
            sure = sure and decided.stopped_by == "confidence"
        label = task.labels[product_label(task.factors, indices)]
        decision = question.decision._replace(label=label)
        return self._answered(replace(question, decision=decision), confidence, sure)


def stopping_rules(model: Model, error: float) -> dict[str, StoppingRule | None]:
    """{task: the fastest stopping rule that is certified for an error rate, or None}.

    Raises:
        InputError: the rate is outside (0, 1), or is certified for no task; the message
            names the errors that are.
    """
    check_rate(error, "the error rate")
    if not model.info.decision_points_s:
        raise InputError(
            f"{model.path}: the model has no calibration, so no error rate can be "
            "held; "
            "export it with --decision-points"
        )
    if model.info.taught:
        raise InputError(
            f"{model.path}: was taught {model.info.taught} trials after its error "
            "rates were "
            "certified; leave --error out, or export a model with these trials"
        )
    rules = {
        task: stopping.rule(error) for task, stopping in model.info.stopping.items()
    }
    if not any(rules.values()):
        reasons = (
            f"{task}: {s.refusal(error)}" for task, s in model.info.stopping.items()
        )
        raise InputError(
            f"{model.path}: an error of {error:g} cannot be certified; "
            f"{'; '.join(reasons)}"
        )
    return rules


def log_rules(model: Model, error: float) -> None:
    """Log how each task is decided under an error rate.

    Raises:
        InputError: as `stopping_rules`.
    """
    for task, rule in stopping_rules(model, error).items():
        if rule is None:
            LOG.warning(
                f"{task}: decided at the end of the window, as an error of {error:g} "
                f"cannot be certified: {model.info.stopping[task].refusal(error)}"
            )
            continue
        if rule.fixed:
            time = f"always after {model.decision_points_s[rule.last]:g} s"
        else:
            time = f"when sure, in training after {rule.mean_s:.2f} s on average"
        LOG.info(f"{task}: decided {time}; at most {rule.error:.1%} wrong")
