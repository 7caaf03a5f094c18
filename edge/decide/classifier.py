"""The classifier: frames in, events out; shared by live reading, replay and the
demo."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from edge.decide.answers import answers_about
from edge.decide.events import Decided, Event, Onset, Release
from edge.decide.model import Model
from edge.decide.no_contact import Untouched
from edge.errors import InputError
from edge.touch.contact import Contact
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout
from edge.wire.skin.loop import Loop

if TYPE_CHECKING:
    from edge.decide.early import Policy
    from edge.decide.no_contact import Untouched
    from edge.record.recording import Recording
    from edge.wire.skin.loop import JointSource, OnsetSource
    from edge.wire.skin.skin import Skin

ASKED_A_SECOND = 200.0
"""Questions to the model about several contacts. Each takes one to two milliseconds on
a workstation; 16 contacts with a decision point every tenth of a second need 160."""
FEWEST_ASKED = 2
"""Questions that a frame may ask, however soon it follows the last one."""


@dataclass
class Pending:
    """A contact for which some tasks are not decided yet.

    Attributes:
        contact: that is followed.
        number: of the contact, from 1, if several are followed at once; else None.
        decision_point: index of the next of the model's decision points.
        tasks: that wait; a joint task stands behind its factors.
        decided: the answers so far, by task.
    """

    contact: Contact
    number: int | None
    decision_point: int
    tasks: list[str]
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
    contact ends. Of several contacts that are due at once, a frame asks about a few, in
    proportion to the time since the last frame, so that no frame takes long; the
    answers are the same.

    With an error rate, each task follows the fastest stopping rule that the model holds
    certified for that rate: it is decided at the first decision point that is sure
    enough, and at the rule's last in any case (see `edge.decide.info`). A task for
    which no rule is certified is decided at the full window, flagged `uncertified`. A
    task that is the joint task of two others, as category is of softness and mobility,
    never contradicts them: it is decided when both are, by their labels, and they
    follow its rule where it has one that is as fast as theirs. An unusual contact waits
    for the full window. `forced` flags that the window ended before the confidence was
    reached.

    A decision has flags, the reasons to doubt it: see `edge.decide.flags`.

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
        max_contacts: int = 1,
        motion_on_skin: bool = False,
    ) -> None:
        """Decide with a model.

        Args:
            model: the model that decides.
            layout: the skin that gives the frames; None for the model's own.
            error: the accepted share of wrong decisions, in (0, 1), for decisions as
                early as that allows; None decides at the full window.
            max_contacts: how many regions to follow at once. 1 follows the largest;
                with more, each event names its contact, and each decision its position.
            motion_on_skin: if the first frame of a contact has no joint angles, measure
                its motion on the skin, flagged `skin_motion`; otherwise its motion is
                left out, flagged `missing_pose`.

        Raises:
            InputError: the skin is not the one that the model was made for, the error
                rate is outside (0, 1), or the model certifies it for no task.
        """
        self.model = model
        self._points_s = model.decision_points_s
        self._last = len(self._points_s) - 1
        """Index of the last decision point."""
        self.error = error
        self._max_contacts = max_contacts
        self._motion_on_skin = motion_on_skin
        self._policies: Mapping[str, Policy] = {}
        """Of each task, with an error rate."""
        if error is not None:
            from edge.decide.early import policies  # few programs decide early

            self._policies = policies(model, error)
        self.tracker = model.info.tracker(
            layout or model.info.layout,
            max_contacts=max_contacts,
            motion_on_skin=motion_on_skin,
        )
        self.layout = self.tracker.layout
        self._pending: list[Pending] = []
        self._numbers: dict[Contact, int | None] = {}
        """The numbers of the contacts under way; None if one is followed."""
        self._begun = 0
        self._end_s: float | None = None
        self._untouched: Untouched | None = None
        if any(task.no_contact is not None for task in model.info.tasks.values()):
            self._untouched = Untouched(model, self.layout)

    def push(self, frame: Frame) -> list[Event]:
        """Take in a frame.

        Raises:
            InputError: the frame's shape is not the skin's, or its time goes back.
        """
        began = time.perf_counter()
        most = self._most_asked(frame.t)
        self._end_s = frame.t
        if self._untouched is not None and self._begun == 0:
            self._untouched.push(frame)
        contacts = self.tracker.push(frame)
        events = self._follow(contacts, frame.t)
        return events + self._decide_due(frame.t, began, most)

    def _most_asked(self, t: float) -> float:
        """How many questions the frame at a time may ask."""
        if self._max_contacts == 1 or self._end_s is None:
            return math.inf
        return max(FEWEST_ASKED, round(ASKED_A_SECOND * (t - self._end_s)))

    def _follow(self, contacts: Iterable[Contact], t: float) -> list[Event]:
        """The events of contacts up to a time."""
        events: list[Event] = []
        for contact in contacts:
            if contact not in self._numbers:
                events.append(self._begin(contact))
            if contact.ended:
                number = self._numbers.pop(contact)
                events.append(Release(contact.onset_s, t, number))
        return events

    def _decide_due(self, t: float, began: float, most: float) -> list[Event]:
        """Ask about the contacts whose next decision point has come, the longest due
        first, and at most so many times."""
        events: list[Event] = []
        questions = 0
        for pending in sorted(self._pending, key=self._due_s):
            while pending.tasks and questions < most:
                point_s = self._points_s[pending.decision_point]
                if t - pending.contact.onset_s < point_s:
                    break
                events += self._decide(pending, began)
                questions += 1
        self._pending = [pending for pending in self._pending if pending.tasks]
        return events

    def _due_s(self, pending: Pending) -> float:
        """When the contact's next decision point comes."""
        return pending.contact.onset_s + self._points_s[pending.decision_point]

    def _begin(self, contact: Contact) -> Onset:
        """Number a contact, and let its tasks wait."""
        self._begun += 1
        number = self._begun if self._max_contacts > 1 else None
        self._numbers[contact] = number
        info = self.model.info
        first = self._last if self.error is None else 0
        tasks = sorted(info.tasks, key=info.joint_tasks.__contains__)
        self._pending.append(Pending(contact, number, first, tasks))
        return Onset(contact.onset_s, number)

    def finish(self) -> list[Event]:
        """End the stream, and decide what waits.

        Tasks that wait are flagged `short`. If no contact came, the tasks that have a
        label for it are decided.
        """
        began = time.perf_counter()
        events: list[Event] = []
        if self._end_s is None:
            return events
        if self._untouched is not None and self._begun == 0:
            events += self._untouched.decisions(self._end_s, began)
        events += self._decide_due(self._end_s, began, math.inf)
        for pending in self._pending:
            pending.decision_point = self._last
            events += self._decide(pending, began, short=True)
        self._pending = []
        return events

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
        onsets: OnsetSource | None = None,
        lasts_s: float = math.inf,
    ) -> Iterator[Event]:
        """Read a skin at its rate and decide, until the caller stops iterating.

        Args:
            skin: open, real or fake.
            joints: the source of joint angles, for a model that measures motion in the
                world.
            onsets: the source of onsets, for a model whose touches begin by an event.
            lasts_s: how many seconds to read for; tasks that wait then are decided,
                flagged `short`.

        Raises:
            InputError: the skin does not suit the model, or joint angles are needed.
        """
        if joints is None and not self._motion_on_skin:
            self.model.require_joints(None, "the skin")
        yield from self._afresh(
            skin.layout,
            Loop(skin, joints=joints, onsets=onsets, lasts_s=lasts_s).frames(),
        )

    def _afresh(self, layout: SkinLayout, frames: Iterable[Frame]) -> Iterator[Event]:
        """The events of a stream of its own, with this classifier's settings."""
        fresh = Classifier(
            self.model,
            layout,
            error=self.error,
            max_contacts=self._max_contacts,
            motion_on_skin=self._motion_on_skin,
        )
        for frame in frames:
            yield from fresh.push(frame)
        yield from fresh.finish()

    def _decide(
        self,
        pending: Pending,
        began: float,
        *,
        short: bool = False,
    ) -> list[Decided]:
        """Ask the model about a contact; the answers of the tasks now decided."""
        point = pending.decision_point
        answers = answers_about(self.model, pending.contact, pending.number, point)
        decided = []
        for task in list(pending.tasks):
            candidate = answers[task].flagged(short=short)
            answer: Decided | None = candidate
            if self._policies and candidate.decision is not None:
                policy = self._policies[task]
                answer = policy.answer(candidate, point, pending.decided)
            if answer is not None:
                pending.decided[task] = answer
                pending.tasks.remove(task)
                decided.append(answer)
        pending.decision_point += 1
        latency_ms = round((time.perf_counter() - began) * 1e3, 3)
        return [replace(answer, latency_ms=latency_ms) for answer in decided]


def suited(model: Model, recording: Recording, name: str) -> Recording:
    """The recording with the joint angles that the model needs.

    Raises:
        InputError: it lacks them; the message begins with `name`.
    """
    if model.info.chain is not None:
        recording = recording.for_joints(model.info.chain.names, name)
    if model.info.onset and not recording.onsets_s:
        if model.info.onset != "first":
            raise InputError(f"{name} has no onset in its meta, which the model needs")
        onset = {"source": "first", "times_s": [float(recording.t[0])]}
        recording = replace(recording, meta={**recording.meta, "onset": onset})
    model.require_joints(recording.dof, name)
    return recording
