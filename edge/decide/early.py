"""Early decisions: policies that follow the stopping rules certified for an error
rate."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from edge.decide.agreement import joint_label
from edge.decide.answers import withheld
from edge.decide.events import Decided
from edge.decide.info import ModelInfo, Stopping, StoppingRule, margin
from edge.decide.model import Decision, Model
from edge.elementary import logistic
from edge.errors import InputError

LOG = logging.getLogger(__name__)
LEAST_ERROR = 1e-6
"""The trials that certify less are beyond all recording, in the end beyond counting."""
TEST_SHARE = 0.5
"""Part of the risk that the tests on calibration trials take. The rest covers the
exported model, which errs more or less often than the folds' models do on average."""


def policies(model: Model, error: float) -> Mapping[str, Policy]:
    """{task: its policy} for an error rate.

    Raises:
        InputError: as `stopping_rules`.
    """
    policy_of: dict[str, Policy] = {}
    for task, rule in stopping_rules(model, error).items():
        if rule is None:
            policy_of[task] = Uncertified(model.info)
        else:
            kind = JointDecision if task in model.info.joint_tasks else Early
            policy_of[task] = kind(model.info, task, rule, error)
    return policy_of


def is_sure(
    stopping: Stopping,
    rule: StoppingRule,
    distances: Sequence[float],
    label: int,
    excess: float,
) -> bool:
    """Whether a label is sure enough for a rule; see `Stopping.confidence`."""
    log_odds = stopping.slope * margin(distances, label) + stopping.intercept
    return logistic(log_odds - stopping.doubt * excess) >= rule.confidence


def is_fixed(rule: StoppingRule) -> bool:
    """Whether a rule waits for a fixed window."""
    return rule.confidence > 1.0


class Uncertified:
    """Decide at the end of the window, as without an error rate, and say so."""

    def __init__(self, info: ModelInfo) -> None:
        self._info = info

    def answer(
        self,
        candidate: Decided,
        point: int,
        decided: Mapping[str, Decided],
    ) -> Decided | None:
        """The model's answer at the last decision point."""
        if point < len(self._info.decision_points_s) - 1:
            return None
        return candidate.flagged(uncertified=True)


class Early:
    """Decide at the first decision point that is sure enough, or at the rule's last."""

    def __init__(
        self,
        info: ModelInfo,
        task: str,
        rule: StoppingRule,
        error: float,
    ) -> None:
        """Follow a rule.

        Args:
            info: the model's metadata.
            task: that is decided.
            rule: certified for the error rate.
            error: the error rate.
        """
        self._info = info
        self._task = info.tasks[task]
        self._rule = rule
        self._error = error
        self._stopping = info.stopping[task]

    def answer(
        self,
        candidate: Decided,
        point: int,
        decided: Mapping[str, Decided],
    ) -> Decided | None:
        """The answer at a decision point; None if the task goes on waiting.

        An unusual contact waits for the full window.

        Args:
            candidate: the model's answer.
            point: index of the decision point.
            decided: the answers to the contact's other tasks so far.
        """
        waits = "unusual" in candidate.flags
        sure = self._is_sure(candidate, point)
        last = len(self._info.decision_points_s) - 1 if waits else self._rule.last
        if point < last and (waits or not sure):
            return None
        return self._answered(candidate, sure)

    def _is_sure(self, candidate: Decided, point: int) -> bool:
        decision = _decision(candidate)
        outlier_score = self._info.outlier_score
        # A model with decision points has both.
        assert outlier_score is not None
        assert decision.label_distances is not None
        label = self._task.labels.index(decision.label)
        excess = outlier_score.excess(point, decision.outlier_score)
        distances = decision.label_distances.tolist()
        return is_sure(self._stopping, self._rule, distances, label, excess)

    def _answered(self, candidate: Decided, sure: bool) -> Decided:
        """The answer of the rule."""
        forced = not (sure or candidate.label is None or is_fixed(self._rule))
        stopped_by = "confidence" if sure else "window"
        answer = replace(candidate, error=self._error, stopped_by=stopped_by)
        # The rule does not go by votes.
        return answer.flagged(forced=forced, tie=False)


class JointDecision(Early):
    """Decide when both factors are, by their labels."""

    def answer(
        self,
        candidate: Decided,
        point: int,
        decided: Mapping[str, Decided],
    ) -> Decided | None:
        """The answer once both factors have theirs."""
        factors = self._task.factors
        if not decided.keys() >= factors.keys():
            return None
        sure = all(decided[factor].stopped_by == "confidence" for factor in factors)
        return self._answered(paired(self._info, candidate, decided), sure)


def paired(
    info: ModelInfo, candidate: Decided, decided: Mapping[str, Decided]
) -> Decided:
    """The answer to a joint task by its factors' labels. An unseen pair has no
    name, nor has one with an unknown factor."""
    task = info.tasks[candidate.task]
    indices = {}
    likely = 1.0
    for factor in task.factors:
        answer = decided[factor]
        labels = info.tasks[factor].labels
        indices[factor] = labels.index(answer.label) if answer.label in labels else -1
        likely *= answer.confidence or 0.0
    index = joint_label(task.factors, indices)
    if index is None or candidate.label is None:
        return withheld(candidate)
    label = task.labels[index]
    decision = _decision(candidate)._replace(label=label)
    confidence = round(likely, 6)
    return replace(candidate, label=label, confidence=confidence, decision=decision)


Policy = Uncertified | Early
"""When and how a task is decided."""


def _decision(candidate: Decided) -> Decision:
    """The model's own answer, which is known of every task that is asked."""
    assert candidate.decision is not None
    return candidate.decision


def stopping_rules(model: Model, error: float) -> dict[str, StoppingRule | None]:
    """{task: the fastest stopping rule that is certified for an error rate, or None}.

    Raises:
        InputError: the rate is below `LEAST_ERROR` or not below 1, or is certified for
            no task; the message names the errors that are.
    """
    if not LEAST_ERROR <= error < 1.0:
        raise InputError(
            f"the error rate must be at least {LEAST_ERROR:g} and below 1, not {error:g}"
        )
    if not model.info.decision_points_s:
        raise InputError(
            f"{model.path}: the model has no calibration, so no error rate can be "
            "held; export it with --decision-points"
        )
    rules = {
        task: fastest(stopping, error) for task, stopping in model.info.stopping.items()
    }
    if not any(rules.values()):
        reasons = (
            f"{task}: {refusal(s, error)}" for task, s in model.info.stopping.items()
        )
        raise InputError(
            f"{model.path}: an error of {error:g} cannot be certified; "
            f"{'; '.join(reasons)}"
        )
    return rules


def refusal(stopping: Stopping, error: float) -> str:
    """A sentence that says why an error rate cannot be certified, and how many
    trials could."""
    share = stopping.wrong / stopping.trials
    sentence = (
        f"the smallest error that {stopping.trials} calibration trials certify is "
        f"{stopping.rules[0].error:.3f}"
    )
    if share >= error:
        return (
            f"{sentence}, and {share:.1%} of them are decided wrongly even at the "
            "full window: more trials alone will not do"
        )
    # Chernoff: this many trials with the same share of errors are enough.
    divergence = (1.0 - share) * (math.log1p(-share) - math.log1p(-error))
    if share > 0.0:
        divergence += share * math.log(share / error)
    level = TEST_SHARE * stopping.risk
    trials = max(math.ceil(-math.log(level) / divergence), stopping.trials + 1)
    return f"{sentence}; {error:g} needs about {trials} trials"


def fastest(stopping: Stopping, error: float) -> StoppingRule | None:
    """The fastest rule that is certified for an error rate; or None."""
    certified = [rule for rule in stopping.rules if rule.error <= error]
    return certified[-1] if certified else None


def log_rules(model: Model, error: float) -> None:
    """Log how each task is decided under an error rate.

    Raises:
        InputError: as `stopping_rules`.
    """
    for task, rule in stopping_rules(model, error).items():
        if rule is None:
            LOG.warning(
                f"{task}: decided at the end of the window, as an error of {error:g} "
                f"cannot be certified: {refusal(model.info.stopping[task], error)}"
            )
            continue
        if is_fixed(rule):
            time = f"always after {model.decision_points_s[rule.last]:g} s"
        else:
            time = f"when sure, in training after {rule.mean_s:.2f} s on average"
        LOG.info(f"{task}: decided {time}; at most {rule.error:.1%} wrong")
