"""Frames in, events out: the one path that live reading, replay, the demo and the tests share."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any

from edge.errors import InputError
from edge.model.model import Decision, Model
from edge.model.prediction_set import NOVELTY_RATE, UNKNOWN, PredictionSet, check_rate
from edge.touch.contact import Contact
from edge.touch.features import feature_vector
from edge.touch.frame import Frame
from edge.touch.layout import SkinLayout, for_device
from edge.touch.track import ContactTracker

AS_TRAINED = "as_trained"
"""Flag of a decision whose features are those of a training trial to the last bit: nearly always
it is that trial, replayed. Only a model that sees whole numbers alone meets such twins anew."""

Event = dict[str, Any]
"""One JSON object; `event` says which."""


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


class Classifier:
    """Watches a stream of frames and decides what each contact touches.

    `push` and `finish` return events in the order in which they came about:

    - `onset`: `onset_s`;
    - `decision`, one a task: `task`, `label`, `confidence`, `window_s`, `onset_s`,
      `latency_ms` (from the frame that completed the window to the decision) and `flags`;
    - `release`: `onset_s`, `release_s`.

    With an error rate, a task is decided at the first of the model's decision points that leaves
    one
    label, else at the full window. `window_s` is then that decision point's, `confidence` is one
    less the
    smallest error at which another label would be left, and a decision also has `error` (asked
    for) and `left` (labels that were not struck out). The further flags are `unknown` (`label`
    is "unknown": no label is left, or the contact lies too far from all that was trained) and
    `unsure` (several are left, and the best of them was taken).

    Flags of a decision: `tie` (another label had as many votes), `short` (the stream ended
    inside the window; its last values held), `missing_taxels` (taxels could not be read),
    `missing_pose` (joint angles were absent in part of the window), `skin_motion` (motion was
    measured on the skin, though the model's is in the world: see `run --without-joints`),
    `out_of_range` (`label` is
    None: the features are too large to be measured against the training rows).

    With `max_contacts` above 1, every region is followed on its own, and each event says of which
    `contact` it is (counted from 1 in the order of their events); a decision then has its `place`
    too ([x, y, z], see `Contact.position`), None where it is not known.
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
        """Watch with a model.

        Args:
            model: what decides.
            layout: the skin that gives the frames; the model's own where None.
            error: how often a label may be wrong, in (0, 1), to decide as soon as that allows;
                None decides at the full window.
            novelty_rate: how often a trained thing may be called unknown for lying far from all.
            max_contacts: how many regions to follow at once; with 1, the largest alone.
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
        self.several = max_contacts > 1
        self.tracker = ContactTracker(
            self.layout,
            info.tracking,
            chain=info.chain,
            horizon_s=info.window_s,
            features=info.features,
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
                events.append({"event": "onset", **self._which(number), "onset_s": contact.onset_s})
            if contact.ended:
                del self._numbers[contact]
                events.append(
                    {
                        "event": "release",
                        **self._which(number),
                        "onset_s": contact.onset_s,
                        "release_s": frame.t,
                    }
                )
        for waiting in list(self._waiting):
            age = frame.t - waiting.contact.onset_s
            while waiting.tasks and age >= self.model.decision_points_s[waiting.decision_point]:
                events += self._ask(waiting, began)
            if not waiting.tasks:
                self._waiting.remove(waiting)
        return events

    def _which(self, number: int) -> Event:
        return {"contact": number} if self.several else {}

    def finish(self) -> list[Event]:
        """The stream has ended: decide what is still waiting, flagged `short`."""
        began = time.perf_counter()
        waiting, self._waiting = self._waiting, []
        return [event for one in waiting for event in self._ask(one, began, short=True)]

    def _ask(self, waiting: _Waiting, began: float, *, short: bool = False) -> list[Event]:
        """Look at a contact; what is decided no longer waits."""
        info = self.model.info
        last = len(self.model.decision_points_s) - 1
        decision_point = last if short else waiting.decision_point
        window = self.model.decision_points_s[decision_point]
        contact = waiting.contact
        vector = feature_vector(contact.series(), window, info.samples, info.features)
        common: Event = {
            "event": "decision",
            **self._which(waiting.number),
            "window_s": window,
            "onset_s": contact.onset_s,
        }
        if self.several:
            position = contact.position()
            common["place"] = None if position is None else [round(x, 6) for x in position.tolist()]
        flags = [
            flag
            for flag, raised in (
                ("short", short),
                ("missing_taxels", contact.missing_taxels),
                ("missing_pose", contact.missing_pose),
                ("skin_motion", contact.chain is None and info.chain is not None),
            )
            if raised
        ]
        try:
            decisions = self.model.decide(vector, None if self.error is None else decision_point)
        except InputError:
            answers = {
                task: {"label": None, "confidence": 0.0, "flags": [*flags, "out_of_range"]}
                for task in waiting.tasks
            }
        else:
            answers = {
                task: answer
                for task in waiting.tasks
                if (
                    answer := self._answer(
                        waiting, task, decisions[task], flags, decision_point == last
                    )
                )
            }
        waiting.decision_point += 1
        waiting.tasks = [task for task in waiting.tasks if task not in answers]
        latency = round((time.perf_counter() - began) * 1e3, 3)
        return [
            {
                **common,
                "task": task,
                "label": answer.pop("label"),
                "confidence": answer.pop("confidence"),
                "latency_ms": latency,
                **answer,
            }
            for task, answer in answers.items()
        ]

    def _answer(
        self, waiting: _Waiting, task: str, decision: Decision, flags: list[str], last: bool
    ) -> Event | None:
        """What a look says of a task; None where it must go on waiting."""
        candidates = waiting.candidates.get(task)
        if decision.distances[0] == 0.0:
            flags = [*flags, AS_TRAINED]
        if candidates is None:
            return {
                "label": decision.label,
                "confidence": decision.confidence,
                "flags": [*flags, "tie"] if decision.tie else list(flags),
            }
        if decision.pvalues is not None and "short" not in flags:
            candidates.update(decision.pvalues)
        if not (candidates.settled or last):
            return None
        labels = self.model.info.tasks[task].labels
        best = candidates.best(labels.index(decision.label))
        sure = candidates.settled
        more = ["unknown"] if candidates.unknown else [] if sure else ["unsure"]
        return {
            "label": UNKNOWN if candidates.unknown else labels[best],
            "confidence": round(candidates.confidence(best), 6),
            "error": candidates.error,
            "left": [labels[i] for i in candidates.left],
            "flags": flags + more,
        }
