"""The model's answers about a contact, with the reasons to doubt them."""

from dataclasses import replace

from edge.decide.doubts import frame_doubts, joint_doubts
from edge.decide.events import Decided
from edge.decide.info import ModelInfo
from edge.decide.model import Decision, Model
from edge.decide.unusual import unusual
from edge.errors import OutOfRange
from edge.touch.contact import Contact, FeatureSeries


def answers_about(
    model: Model,
    contact: Contact,
    number: int | None,
    point: int,
) -> dict[str, Decided]:
    """Ask the model about a contact.

    Args:
        model: that answers.
        contact: with its frames so far.
        number: of the contact, if several are followed at once; else None.
        point: index of the decision point.

    Returns:
        {task: its answer}, with the confidence rounded to millionths and without
        latency. Features that cannot be scaled give no label.
    """
    info = model.info
    window_s = model.decision_points_s[point]
    series = contact.series()
    answer = Decided(
        task="",
        label=None,
        confidence=0.0,
        window_s=window_s,
        onset_s=contact.onset_s,
        latency_ms=0.0,
        contact=number,
        model=model.named,
    ).flagged(**contact_doubts(info, contact, series, window_s))
    if number is not None:
        answer = replace(answer, position=_position(contact))
    try:
        vector = info.vector(series, window_s)
        decisions = model.decide(vector, point)
    except OutOfRange:
        answer = answer.flagged(out_of_range=True)
        return {task: replace(answer, task=task) for task in info.tasks}
    if info.outlier_score is not None:
        score = next(iter(decisions.values())).outlier_score
        is_unusual = score > info.outlier_score.limits[point]
        answer = answer.flagged(unusual=is_unusual)
        if is_unusual and window_s == info.window_s:
            phrase = unusual(vector, info.widths, info.usual)
            answer = replace(answer, unusual=phrase)
    return {
        task: _answer(replace(answer, task=task), decision, info, point)
        for task, decision in decisions.items()
    }


def contact_doubts(
    info: ModelInfo,
    contact: Contact,
    series: FeatureSeries,
    window_s: float,
) -> dict[str, bool]:
    """{flag: whether it holds} for a measured contact, see `edge.decide.flags`."""
    doubts = frame_doubts(series, window_s)
    if info.joints:
        limits = () if info.chain is None else info.chain.limits
        doubts |= joint_doubts(series, window_s, limits, info.still_s, info.speeds)
    return {
        **doubts,
        "frozen": doubts["frozen"] and not info.repeats,
        "missing_taxels": contact.missing_taxels,
        "missing_pose": contact.missing_pose,
        "late": contact.late and not info.onset,
        "skin_motion": contact.chain is None and info.chain is not None,
    }


def _position(contact: Contact) -> tuple[float, float, float] | None:
    """Where the contact was last seen, rounded to micrometres."""
    position = contact.position()
    if position is None:
        return None
    x, y, z = (round(metres, 6) for metres in position)
    return x, y, z


def _answer(
    blank: Decided,
    decision: Decision,
    info: ModelInfo,
    point: int,
) -> Decided:
    """A task's answer, with the doubts of the decision."""
    confidence = decision.confidence
    answer = replace(
        blank,
        label=decision.label,
        confidence=confidence and round(confidence, 6),
        nearest=tuple(map(info.trial, decision.neighbours.tolist())),
        decision=decision,
    ).flagged(
        as_trained=bool((decision.distances[:1] == 0.0).any()),
        out_of_range=decision.out_of_range,
        tie=decision.tie,
    )
    stopping = info.stopping.get(blank.task)
    doubt = stopping and stopping.known_distance
    if doubt and decision.known_distance > doubt.limits[point]:
        return withheld(answer)
    return answer


def withheld(answer: Decided) -> Decided:
    """The answer without a label, flagged as `unknown`."""
    return replace(answer, label=None, confidence=0.0).flagged(unknown=True)
