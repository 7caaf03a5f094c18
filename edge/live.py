"""Frames in, events out: the one path that live reading, replay, the demo and the tests share."""

from __future__ import annotations

import time
from typing import Any

from edge.errors import InputError
from edge.features import feature_vector
from edge.frame import Frame
from edge.layout import SkinLayout
from edge.model import Model
from edge.track import Contact, Tracker, Tracks, for_device

Event = dict[str, Any]
"""One JSON object; `event` says which."""


class Watcher:
    """Watches a stream of frames and decides what each contact touches.

    `push` and `finish` return events in the order in which they came about:

    - `onset`: `onset_s`;
    - `decision`, one a task: `task`, `label`, `confidence`, `window_s`, `onset_s`,
      `latency_ms` (from the frame that completed the window to the decision) and `flags`;
    - `release`: `onset_s`, `release_s`.

    Flags of a decision: `tie` (another label had as many votes), `short` (the stream ended
    inside the window; its last values held), `missing_taxels` (taxels could not be read),
    `missing_pose` (joint angles were absent in part of the window), `skin_motion` (motion was
    measured on the skin, though the model's is in the world: see `run --without-joints`),
    `out_of_range` (`label` is
    None: the features are too large to be measured against the training rows).

    With `several`, every region is followed on its own, and each event says of which `contact`
    it is (counted from 1 in the order of their events); a decision then has its `place` too
    ([x, y, z], see `edge.track.Contact.place`), None where it is not known.
    """

    def __init__(
        self, model: Model, layout: SkinLayout | None = None, *, several: bool = False
    ) -> None:
        """Watch with a model.

        Args:
            model: what decides.
            layout: the skin that gives the frames; the model's own where None.
            several: follow every region, not the largest alone.

        Raises:
            InputError: the skin is not the one that the model was made for.
        """
        info = model.info
        self.model = model
        self.layout = for_device(info.layout, layout or info.layout)
        self.several = several
        self.tracker = (Tracks if several else Tracker)(
            self.layout,
            info.tracking,
            chain=info.chain,
            horizon_s=info.window_s,
            features=info.features,
        )
        self._waiting: list[Contact] = []
        self._current: dict[int, Contact] = {}
        """Contacts under way by their number."""
        self._begun = 0

    def push(self, frame: Frame) -> list[Event]:
        """Take in a frame.

        Raises:
            InputError: the frame's shape is not the skin's, or its time goes back.
        """
        began = time.perf_counter()
        events: list[Event] = []
        for contact in self.tracker.follow(frame):
            number = self._number(contact)
            if number is None:
                self._begun += 1
                number = self._begun
                self._current[number] = contact
                self._waiting.append(contact)
                events.append({"event": "onset", **self._which(number), "onset_s": contact.onset_s})
            if contact.ended:
                events.append(
                    {
                        "event": "release",
                        **self._which(number),
                        "onset_s": contact.onset_s,
                        "release_s": frame.t,
                    }
                )
        if self._waiting:
            window = self.model.info.window_s
            due = [c for c in self._waiting if frame.t - c.onset_s >= window]
            if due:
                self._waiting = [c for c in self._waiting if frame.t - c.onset_s < window]
            for contact in due:
                events += self._decide(contact, began, short=False)
        if self._current:
            self._forget()
        return events

    def _number(self, contact: Contact) -> int | None:
        for number, known in self._current.items():
            if known is contact:
                return number
        return None

    def _forget(self) -> None:
        """Contacts that are over and decided."""
        waiting = {id(contact) for contact in self._waiting}
        for number, contact in list(self._current.items()):
            if contact.ended and id(contact) not in waiting:
                del self._current[number]

    def _which(self, number: int | None) -> Event:
        return {"contact": number} if self.several else {}

    def finish(self) -> list[Event]:
        """The stream has ended: decide what is still waiting, flagged `short`."""
        began = time.perf_counter()
        waiting, self._waiting = self._waiting, []
        return [event for c in waiting for event in self._decide(c, began, short=True)]

    def _decide(self, contact: Contact, began: float, *, short: bool) -> list[Event]:
        info = self.model.info
        vector = feature_vector(contact.series(), info.window_s, info.samples, info.features)
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
        common: Event = {
            "event": "decision",
            **self._which(self._number(contact)),
            "window_s": info.window_s,
            "onset_s": contact.onset_s,
        }
        if self.several:
            place = contact.place()
            common["place"] = None if place is None else [round(x, 6) for x in place.tolist()]
        try:
            decisions = self.model.decide(vector)
        except InputError:
            latency = (time.perf_counter() - began) * 1e3
            return [
                {
                    **common,
                    "task": task,
                    "label": None,
                    "confidence": 0.0,
                    "latency_ms": round(latency, 3),
                    "flags": [*flags, "out_of_range"],
                }
                for task in info.tasks
            ]
        latency = (time.perf_counter() - began) * 1e3
        return [
            {
                **common,
                "task": task,
                "label": decision.label,
                "confidence": decision.confidence,
                "latency_ms": round(latency, 3),
                "flags": [*flags, "tie"] if decision.tie else list(flags),
            }
            for task, decision in decisions.items()
        ]


def require_joints(model: Model, dof: int | None, where: str) -> None:
    """Refuse a source whose joint angles are not what the model's motion is measured with.

    Raises:
        InputError: the sentence names `where`.
    """
    chain = model.info.chain
    if chain is None:
        return
    if dof is None:
        raise InputError(
            f"{where}: has no joint angles, the model measures motion with {chain.dof}; "
            "record them, or export a model without joints"
        )
    if dof != chain.dof:
        raise InputError(f"{where}: has {dof} joint angles, the model's arm has {chain.dof}")
