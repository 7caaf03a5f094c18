"""The classifier: frames in, events out; shared by live reading, replay, the demo and
the tests."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from edge.errors import InputError, OutOfRange
from edge.events import Decided, Event, Onset, Release
from edge.model.agreement import product_label
from edge.model.model import Decision, Model, require_joints
from edge.model.stopping import NOVELTY_RATE, UNKNOWN, StoppingRule, check_rate, margin
from edge.recording import Recording
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout

if TYPE_CHECKING:
    from edge.skin.loop import JointSource
    from edge.skin.skin import Skin

AS_TRAINED = "as_trained"
"""Flag of a decision at distance 0 from a training trial: the two have the same
coordinates, which are all that the model compares. Nearly always the touch is that
trial, replayed. Features that were constant in training, or have no weight in the
projection, may differ."""
OUT_OF_RANGE = "out_of_range"
"""Flag of a decision on features that lie far outside those of the training trials. The
model cuts them off before it compares them; features that it cannot scale at all get no
label."""
GAP_SHARE, GAP_S = 0.25, 0.1
"""Between two frames, a step of more than this share of the window and of more than
this time is a gap: the samples in it are interpolated from its ends."""


@dataclass
class _Waiting:
    """A contact for which some tasks are not decided yet."""

    contact: Contact
    number: int
    decision_point: int
    """Index of the next of the model's decision points."""
    tasks: list[str]
    """The tasks that wait; a product stands behind its factors."""
    decided: dict[str, Decided] = field(default_factory=dict)


class Classifier:
    """Follows the contacts in a stream of frames and decides what the robot touches in
    each.

    >>> import edge
    >>> from edge import demo
    >>> classifier = edge.Classifier(edge.Model(demo.MODEL))
    >>> for event in classifier.classify(edge.load(demo.FOLDER / "pillow-movable.npz")):
    ...     if isinstance(event, edge.Decided):
    ...         print(event.task, event.label)
    category soft-movable
    mobility movable
    object pillow

    `push` and `finish` return events in the order of time: an `Onset` when a contact
    begins, a `Decided` for each task at the end of its window, and a `Release` when the
    contact ends.

    With an error rate, each task follows the fastest stopping rule that the model holds
    certified for that rate: it is decided at the first decision point that is sure
    enough, and at the rule's last in any case (see `edge.model.stopping`). A task for
    which no rule is certified is decided at the full window, flagged `uncertified`. A
    task that is the product of two others, as category is of softness and mobility,
    never contradicts them: it is decided when both are, by their labels, and they
    follow its rule where it has one. An unknown contact waits for the full window, and
    the label of the task with the most labels, such as the object, is then "unknown".
    `unsure` flags that the window ended before the confidence was reached.

    Flags of a decision: `unknown` (the contact is unlike everything in training; only a
    model with decision points can tell), `tie` (another label had as many votes),
    `short` (the stream ended inside the window; the last values were held), `gap`
    (frames are missing in much of the window, see `GAP_SHARE`, or its times are not in
    seconds), `missing_taxels` (taxels could not be read), `missing_pose` (joint angles
    were absent in part of the window), `skin_motion` (motion was measured on the skin,
    though the model's is in the world), `as_trained` (see `AS_TRAINED`) and
    `out_of_range` (see `OUT_OF_RANGE`).

    A task that was trained with recordings of no contact is decided by `finish` where
    there was none, flagged `no_contact` and at the time of the last frame;
    `missing_taxels` says that a frame lacked some, and `near_contact` that a taxel rose
    above the contact threshold, so that a weak touch may have been missed. `strongest`
    says how near it came.
    """

    def __init__(
        self,
        model: Model,
        layout: SkinLayout | None = None,
        *,
        error: float | None = None,
        novelty_rate: float = NOVELTY_RATE,
        max_contacts: int = 1,
        motion_on_skin: bool = False,
    ) -> None:
        """Decide with a model.

        Args:
            model: the model that decides.
            layout: the skin that gives the frames; None for the model's own.
            error: the accepted share of wrong decisions, in (0, 1), for decisions as
                early as that allows; None decides at the full window.
            novelty_rate: the accepted share of contacts with trained objects that are
                called unknown. The certified errors hold for the default.
            max_contacts: how many regions to follow at once. 1 follows the largest;
                with more, each event names its contact, and each decision its position.
            motion_on_skin: if the first frame of a contact has no joint angles, measure
                its motion on the skin, flagged `skin_motion`; otherwise its motion is
                left out, flagged `missing_pose`.

        Raises:
            InputError: the skin is not the one that the model was made for, a rate is
                outside (0, 1), or the model certifies the error rate for no task.
        """
        check_rate(novelty_rate, "the novelty rate")
        self._rules = {} if error is None else stopping_rules(model, error)
        self.model, self.error, self.novelty_rate = model, error, novelty_rate
        self._max_contacts, self._motion_on_skin = max_contacts, motion_on_skin
        self.tracker = model.info.tracker(
            layout or model.info.layout,
            max_contacts=max_contacts,
            motion_on_skin=motion_on_skin,
        )
        self.layout = self.tracker.layout
        self._waiting: list[_Waiting] = []
        self._numbers: dict[Contact, int] = {}
        """The numbers of the contacts under way."""
        self._begun = 0
        self._end_s: float | None = None
        self._missing_taxels = False
        self._strongest = 0

    def push(self, frame: Frame) -> list[Event]:
        """Take in a frame.

        Raises:
            InputError: the frame's shape is not the skin's, or its time goes back.
        """
        began = time.perf_counter()
        events: list[Event] = []
        self._end_s = frame.t
        if self._begun == 0:
            readable = np.True_ if frame.valid is None else frame.valid
            strongest = int(frame.counts.max(initial=0, where=readable))
            self._strongest = max(self._strongest, strongest)
            self._missing_taxels |= bool((self.layout.alive & ~readable).any())
        for contact in self.tracker.push(frame):
            if contact not in self._numbers:
                self._begun += 1
                self._numbers[contact] = number = self._begun
                first = (
                    0
                    if self.error is not None
                    else len(self.model.decision_points_s) - 1
                )
                info = self.model.info
                tasks = sorted(info.tasks, key=info.products.__contains__)
                self._waiting.append(_Waiting(contact, number, first, tasks))
                events.append(Onset(contact.onset_s, self._named(number)))
            if contact.ended:
                number = self._numbers.pop(contact)
                events.append(Release(contact.onset_s, frame.t, self._named(number)))
        for waiting in list(self._waiting):
            age = frame.t - waiting.contact.onset_s
            while (
                waiting.tasks
                and age >= self.model.decision_points_s[waiting.decision_point]
            ):
                events += self._decide(waiting, began)
            if not waiting.tasks:
                self._waiting.remove(waiting)
        return events

    def finish(self) -> list[Event]:
        """End the stream: decide the tasks that wait, flagged `short`, or that no
        contact came."""
        began = time.perf_counter()
        unfinished, self._waiting = self._waiting, []
        if self._begun == 0 and self._end_s is not None:
            return list(self._untouched(self._end_s, began))
        return [
            event for w in unfinished for event in self._decide(w, began, short=True)
        ]

    def _untouched(self, end_s: float, began: float) -> Iterator[Decided]:
        """Decisions on a stream without contact, for the tasks that have a label for
        it."""
        near = self._strongest > self.layout.threshold_counts
        doubts = {
            "no_contact": True,
            "missing_taxels": self._missing_taxels,
            "near_contact": near,
        }
        strongest = round(self._strongest / max(self.layout.onset, 1), 3)
        for name, task in self.model.info.tasks.items():
            if task.no_contact is not None:
                latency_ms = round((time.perf_counter() - began) * 1e3, 3)
                yield Decided(
                    name, task.no_contact, 1.0, 0.0, end_s, latency_ms, _flags(doubts),
                    strongest=strongest, model=self.model.named,
                )  # fmt: skip

    def classify(self, recording: Recording) -> Iterator[Event]:
        """Decide on a recording as the board would have; this classifier's own state
        stays.

        Args:
            recording: of a skin like the model's; its own scale is taken into account,
                and so is the order of its joints.

        Raises:
            InputError: the recording does not suit the model.
        """
        if not (self._motion_on_skin and recording.joints is None):
            recording = suited(self.model, recording, "the recording")
        yield from self._afresh(recording.layout, recording)

    def watch(
        self,
        skin: Skin,
        *,
        joints: JointSource | None = None,
        lasts_s: float = math.inf,
    ) -> Iterator[Event]:
        """Read a skin at its rate and decide, until the caller stops iterating.

        Args:
            skin: open, real or fake.
            joints: the source of joint angles, for a model that measures motion in the
                world.
            lasts_s: how many seconds to read for; tasks that wait then are decided,
                flagged `short`.

        Raises:
            InputError: the skin does not suit the model, or joint angles are needed.
        """
        from edge.skin.loop import Loop  # a replay needs no bus

        if joints is None and not self._motion_on_skin:
            require_joints(self.model, None, "the skin")
        yield from self._afresh(
            skin.layout, Loop(skin, joints=joints, lasts_s=lasts_s).frames()
        )

    def _afresh(self, layout: SkinLayout, frames: Iterable[Frame]) -> Iterator[Event]:
        """The events of a stream of its own, with this classifier's settings."""
        fresh = Classifier(
            self.model, layout, error=self.error, novelty_rate=self.novelty_rate,
            max_contacts=self._max_contacts, motion_on_skin=self._motion_on_skin,
        )  # fmt: skip
        for frame in frames:
            yield from fresh.push(frame)
        yield from fresh.finish()

    def _named(self, number: int) -> int | None:
        """The contact's number if several are followed at once, else None."""
        return number if self._max_contacts > 1 else None

    def _decide(
        self, waiting: _Waiting, began: float, *, short: bool = False
    ) -> list[Decided]:
        """Ask the model about a contact; returns the answers of the tasks that are now
        decided."""
        info = self.model.info
        if short:
            waiting.decision_point = len(self.model.decision_points_s) - 1
        decision_point = waiting.decision_point
        window_s = self.model.decision_points_s[decision_point]
        contact, series = waiting.contact, waiting.contact.series()
        longest_s = np.diff(np.minimum(series.t, window_s)).max(initial=0.0)
        doubts = {
            "short": short,
            "gap": longest_s > max(GAP_SHARE * window_s, GAP_S),
            "missing_taxels": contact.missing_taxels,
            "missing_pose": contact.missing_pose,
            "skin_motion": contact.chain is None and info.chain is not None,
        }
        flags, position = _flags(doubts), None
        if self._max_contacts > 1 and (at := contact.position()) is not None:
            x, y, z = (round(value, 6) for value in at)
            position = x, y, z
        number = self._named(waiting.number)
        answers = [
            Decided(task, None, 0.0, window_s, contact.onset_s, 0.0, flags, contact=number,
                    position=position, model=self.model.named)
            for task in waiting.tasks
        ]  # fmt: skip
        try:
            vector = info.vector(series, window_s)
            decisions = self.model.decide(
                vector, None if self.error is None else decision_point
            )
        except OutOfRange:
            answers = [
                replace(answer, flags=(*flags, OUT_OF_RANGE)) for answer in answers
            ]
        else:
            novel, novelty = 1.0, info.novelty
            if novelty is not None:
                distance = float(decisions[novelty.task].distances[0])
                novel = novelty.rate(decision_point, distance)
            for blank in answers:
                answer = self._answer(waiting, blank, decisions[blank.task], novel)
                if answer is not None:
                    waiting.decided[answer.task] = answer
            answers = [
                waiting.decided[t] for t in waiting.tasks if t in waiting.decided
            ]
        waiting.decision_point += 1
        for answer in answers:
            waiting.tasks.remove(answer.task)
        latency_ms = round((time.perf_counter() - began) * 1e3, 3)
        return [replace(answer, latency_ms=latency_ms) for answer in answers]

    def _answer(
        self, waiting: _Waiting, blank: Decided, decision: Decision, novel: float
    ) -> Decided | None:
        """A task's answer at a decision point; None if the task goes on waiting.

        Args:
            waiting: the contact.
            blank: the task's answer, without a label yet.
            decision: of the model.
            novel: the smallest novelty rate at which the contact counts as unknown.
        """
        info, at, error = self.model.info, waiting.decision_point, self.error
        task, rule = info.tasks[blank.task], self._rules.get(blank.task)
        label, confidence = decision.label, decision.confidence
        unknown = novel <= self.novelty_rate
        nameless = sure = False
        if error is not None and task.factors:
            if not waiting.decided.keys() >= task.factors.keys():
                return None
            factors = {factor: waiting.decided[factor] for factor in task.factors}
            indices = {
                f: info.tasks[f].labels.index(str(d.label)) for f, d in factors.items()
            }
            label = task.labels[product_label(task.factors, indices)]
            confidence = math.prod(decided.confidence for decided in factors.values())
            sure = all(
                decided.stopped_by == "confidence" for decided in factors.values()
            )
            decision = decision._replace(label=label)
        elif error is not None:
            assert decision.label_distances is not None
            stopping = info.stopping[blank.task]
            evidence = margin(
                decision.label_distances.tolist(), task.labels.index(label)
            )
            confidence = stopping.confidence(at, evidence)
            sure = rule is not None and stopping.sure(rule, evidence)
            full = len(self.model.decision_points_s) - 1
            last = full if rule is None or unknown else rule.last
            if at < last and (unknown or not sure):
                return None
        if error is not None and unknown and info.novelty is not None:
            nameless = blank.task == info.novelty.task
        if nameless:
            label, confidence = UNKNOWN, 1.0 - novel
        doubts = {
            AS_TRAINED: decision.distances[0] == 0.0,
            OUT_OF_RANGE: decision.out_of_range,
            "unknown": unknown,
            "tie": error is None and decision.tie,
            "unsure": not (rule is None or rule.fixed or sure or nameless),
            "uncertified": error is not None and rule is None,
        }
        return replace(
            blank,
            label=label,
            confidence=confidence if error is None else round(confidence, 6),
            flags=(*blank.flags, *_flags(doubts)),
            error=None if rule is None else error,
            stopped_by=None if rule is None else "confidence" if sure else "window",
            nearest=tuple(map(info.trial, decision.neighbours.tolist())),
            decision=decision,
        )


def _flags(doubts: Mapping[str, bool]) -> tuple[str, ...]:
    """The names of the doubts that hold."""
    return tuple(flag for flag, holds in doubts.items() if holds)


def suited(model: Model, recording: Recording, name: str) -> Recording:
    """The recording with the joint angles that the model needs.

    Raises:
        InputError: it lacks them; the message begins with `name`.
    """
    if model.info.chain is not None:
        recording = recording.for_joints(model.info.chain.names, name)
    require_joints(model, recording.dof, name)
    return recording


def stopping_rules(model: Model, error: float) -> dict[str, StoppingRule | None]:
    """{task: the fastest stopping rule that is certified for an error rate, or None}.

    Raises:
        InputError: the rate is outside (0, 1), or is certified for no task; the message
            names the errors that are.
    """
    check_rate(error, "the error rate")
    if not model.info.decision_points_s:
        raise InputError(
            f"{model.path}: the model has no calibration, so no error rate can be held; "
            "export it with --decision-points"
        )
    if model.info.taught:
        raise InputError(
            f"{model.path}: was taught {model.info.taught} trials after its error rates were "
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
            f"{model.path}: an error of {error:g} cannot be certified; {'; '.join(reasons)}"
        )
    return rules
