"""Frames in, events out: the one path that live reading, replay, the demo and the tests share."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from edge.errors import InputError
from edge.events import Decided, Event, Onset, Release
from edge.model.model import Decision, Model, require_joints
from edge.model.prediction_set import NOVELTY_RATE, UNKNOWN, PredictionSet, check_rate
from edge.recording import Recording
from edge.touch.contact import Contact
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker

if TYPE_CHECKING:
    from edge.skin.loop import JointSource
    from edge.skin.skin import Skin

AS_TRAINED = "as_trained"
"""Flag of a decision whose features are those of a training trial to the last bit: nearly always
it is that trial, replayed. Only a model that sees whole numbers alone meets such twins anew."""


@dataclass
class _Waiting:
    """A contact that has yet to be decided for some tasks."""

    contact: Contact
    number: int
    decision_point: int
    """The next of the model's decision points."""
    tasks: list[str]
    candidates: dict[str, PredictionSet] = field(default_factory=dict)
    """By task, where an error rate was asked for."""


class _Answer(NamedTuple):
    """What is said of one task."""

    label: str | None
    confidence: float
    flags: tuple[str, ...]
    remaining: tuple[str, ...] | None = None
    decision: Decision | None = None


class Classifier:
    """Follows the contacts in a stream of frames and decides what each one touches.

    >>> import edge
    >>> from edge import demo
    >>> classifier = edge.Classifier(edge.Model(demo.MODEL))
    >>> for event in classifier.classify(edge.load(demo.FOLDER / "pillow-movable.npz")):
    ...     if isinstance(event, edge.Decided):
    ...         print(event.task, event.label)
    category soft-movable
    mobility movable
    object pillow

    `push` and `finish` return events in the order in which they came about: an `Onset` when a
    contact begins, a `Decided` for each task once its window is over, and a `Release` when the
    contact ends.

    With an error rate, a task is decided at the first of the model's decision points at which one
    label remains, or else at the full window. Further flags are then `unknown` (the label is
    "unknown": none remains, or the contact lies too far from everything in training) and `unsure`
    (several remain, and the best of them was taken).

    Flags of a decision: `tie` (another label had as many votes), `short` (the stream ended
    inside the window; the last values were held), `missing_taxels` (taxels could not be read),
    `missing_pose` (joint angles were absent in part of the window), `skin_motion` (motion was
    measured on the skin, though the model's is in the world), `as_trained` (see `AS_TRAINED`) and
    `out_of_range` (there is no label, as the features are too large to be measured against the
    training rows).
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
            model: what decides.
            layout: the skin that gives the frames; the model's own where None.
            error: how often a label may be wrong, in (0, 1), to decide as soon as that allows;
                None decides at the full window.
            novelty_rate: how often a trained thing may be called unknown for lying far from all
                others.
            max_contacts: how many regions to follow at once. With 1 it is the largest; with more,
                each event names its contact, and a decision its position.
            motion_on_skin: decide a contact whose first frame has no joint angles by motion on
                the skin, flagged `skin_motion`; else by what else is known, flagged
                `missing_pose`.

        Raises:
            InputError: the skin is not the one that the model was made for, a rate is outside
                (0, 1), or the model has no calibration to hold an error rate with.
        """
        info = model.info
        if error is not None:
            check_rate(error, "the error rate")
            check_rate(novelty_rate, "the rate of false alarms")
            if not info.decision_points_s:
                raise InputError(
                    f"{model.path}: has no calibration to hold an error rate with; "
                    "export it with --decision-points"
                )
        self.model = model
        self.layout = for_device(info.layout, layout or info.layout)
        self._max_contacts, self._motion_on_skin = max_contacts, motion_on_skin
        self.tracker = ContactTracker(
            self.layout,
            info.tracking,
            chain=info.chain,
            horizon_s=info.window_s,
            features=info.features,
            joints=info.joints,
            max_contacts=max_contacts,
            motion_on_skin=motion_on_skin,
        )
        self.error, self.novelty_rate = error, novelty_rate
        self._waiting: list[_Waiting] = []
        self._numbers: dict[Contact, int] = {}
        """The contacts under way."""
        self._begun = 0

    def _begin(self, contact: Contact, number: int) -> _Waiting:
        tasks = self.model.info.tasks
        if self.error is None:
            return _Waiting(contact, number, len(self.model.decision_points_s) - 1, list(tasks))
        left = {
            name: PredictionSet(len(task.labels), self.error, self.novelty_rate)
            for name, task in tasks.items()
        }
        return _Waiting(contact, number, 0, list(tasks), left)

    def push(self, frame: Frame) -> list[Event]:
        """Take in a frame.

        Raises:
            InputError: the frame's shape is not the skin's, or its time goes back.
        """
        began = time.perf_counter()
        events: list[Event] = []
        for contact in self.tracker.push(frame):
            number = self._numbers.get(contact)
            if number is None:
                self._begun += 1
                number = self._begun
                self._numbers[contact] = number
                self._waiting.append(self._begin(contact, number))
                events.append(Onset(contact.onset_s, self._named(number)))
            if contact.ended:
                del self._numbers[contact]
                events.append(Release(contact.onset_s, frame.t, self._named(number)))
        for waiting in list(self._waiting):
            age = frame.t - waiting.contact.onset_s
            while waiting.tasks and age >= self.model.decision_points_s[waiting.decision_point]:
                events += self._decide(waiting, began)
            if not waiting.tasks:
                self._waiting.remove(waiting)
        return events

    def finish(self) -> list[Event]:
        """The stream has ended: decide what is still waiting, flagged `short`."""
        began = time.perf_counter()
        waiting, self._waiting = self._waiting, []
        return [event for one in waiting for event in self._decide(one, began, short=True)]

    def classify(self, recording: Recording) -> Iterator[Event]:
        """Decide on a recording from its first frame, as the board would have.

        Contacts that this classifier is following are left alone.

        Args:
            recording: of a skin of the model's kind; its own scale is taken into account.

        Raises:
            InputError: the recording does not suit the model.
        """
        if not (self._motion_on_skin and recording.joints is None):
            joints = recording.joints
            require_joints(self.model, None if joints is None else joints.shape[1], "the recording")
        fresh = self._fresh(recording.layout)
        for frame in recording:
            yield from fresh.push(frame)
        yield from fresh.finish()

    def watch(
        self, skin: Skin, *, joints: JointSource | None = None, lasts_s: float = math.inf
    ) -> Iterator[Event]:
        """Read a skin at its rate and decide, until the caller stops asking.

        Args:
            skin: open, real or fake.
            joints: where joint angles come from, for a model that measures motion in the world.
            lasts_s: how many seconds to read for; what is waiting then is decided, flagged
                `short`.

        Raises:
            InputError: the skin does not suit the model, or joint angles are needed.
        """
        from edge.skin.loop import Loop  # a replay needs no bus

        if joints is None and not self._motion_on_skin:
            require_joints(self.model, None, "the skin")
        fresh = self._fresh(skin.layout)
        for frame in Loop(skin, joints=joints, lasts_s=lasts_s).frames():
            yield from fresh.push(frame)
        yield from fresh.finish()

    def _fresh(self, layout: SkinLayout) -> Classifier:
        return Classifier(
            self.model,
            layout,
            error=self.error,
            novelty_rate=self.novelty_rate,
            max_contacts=self._max_contacts,
            motion_on_skin=self._motion_on_skin,
        )

    def _named(self, number: int) -> int | None:
        """A contact's number, where there may be several at once."""
        return number if self._max_contacts > 1 else None

    def _decide(self, waiting: _Waiting, began: float, *, short: bool = False) -> list[Decided]:
        """Ask the model about a contact; a task that it settles no longer waits."""
        info = self.model.info
        last = len(self.model.decision_points_s) - 1
        decision_point = last if short else waiting.decision_point
        window_s = self.model.decision_points_s[decision_point]
        contact = waiting.contact
        vector = feature_vector(contact.series(), window_s, info.samples, info.features)
        flags = tuple(
            flag
            for flag, raised in (
                ("short", short),
                ("missing_taxels", contact.missing_taxels),
                ("missing_pose", contact.missing_pose),
                ("skin_motion", contact.chain is None and info.chain is not None),
            )
            if raised
        )
        try:
            decisions = self.model.decide(vector, None if self.error is None else decision_point)
        except InputError:
            none = _Answer(None, 0.0, (*flags, "out_of_range"))
            answers = dict.fromkeys(waiting.tasks, none)
        else:
            answers = {
                task: answer
                for task in waiting.tasks
                if (
                    answer := self._answer(
                        waiting, task, decisions[task], flags, last=decision_point == last
                    )
                )
            }
        waiting.decision_point += 1
        waiting.tasks = [task for task in waiting.tasks if task not in answers]
        position = None
        if self._max_contacts > 1 and (at := contact.position()) is not None:
            x, y, z = (round(value, 6) for value in at.tolist())
            position = x, y, z
        latency_ms = round((time.perf_counter() - began) * 1e3, 3)
        return [
            Decided(
                task,
                answer.label,
                answer.confidence,
                window_s,
                contact.onset_s,
                latency_ms,
                answer.flags,
                error=self.error if answer.remaining is not None else None,
                remaining=answer.remaining,
                contact=self._named(waiting.number),
                position=position,
                decision=answer.decision,
            )
            for task, answer in answers.items()
        ]

    def _answer(
        self,
        waiting: _Waiting,
        task: str,
        decision: Decision,
        flags: tuple[str, ...],
        *,
        last: bool,
    ) -> _Answer | None:
        """What a decision point says of a task; None where the task goes on waiting."""
        if decision.distances[0] == 0.0:
            flags = (*flags, AS_TRAINED)
        candidates = waiting.candidates.get(task)
        if candidates is None:
            if decision.tie:
                flags = (*flags, "tie")
            return _Answer(decision.label, decision.confidence, flags, decision=decision)
        if decision.pvalues is not None and "short" not in flags:
            candidates.narrow(decision.pvalues)
        if not (candidates.settled or last):
            return None
        labels = self.model.info.tasks[task].labels
        best = candidates.best(labels.index(decision.label))
        if candidates.unknown:
            flags = (*flags, "unknown")
        elif not candidates.settled:
            flags = (*flags, "unsure")
        return _Answer(
            UNKNOWN if candidates.unknown else labels[best],
            round(candidates.confidence(best), 6),
            flags,
            tuple(labels[i] for i in candidates.remaining),
            decision,
        )
